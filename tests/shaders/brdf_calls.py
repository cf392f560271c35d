"""What tests ask of the BRDF of surfaces that they describe in a struct of their own."""


def brdf_calls(given: str) -> str:
    """Slang functions of a struct of that name, for which `surface(given)` makes the parameters."""
    return _CALLS.replace("GIVEN", given)


_CALLS = """
float4 direction(GIVEN given, float3 view, float3 u)
{
    let s = BrdfTowards.create(surface(given), view).sample(u);
    return float4(s.direction, s.pdf);
}
float4 mirrored(GIVEN given, float3 view, float3 u)
{
    let s = BrdfTowards.create(surface(given), view).sampleSpecular(u);
    return float4(s.direction, s.pdf);
}
float3 mirroredWeight(GIVEN given, float3 view, float3 u)
{
    return BrdfTowards.create(surface(given), view).sampleSpecular(u).weight;
}
float density(GIVEN given, float3 view, float3 light) { return BrdfTowards.create(surface(given), view).pdf(light); }
float mirroredDensity(GIVEN given, float3 view, float3 light)
{
    return BrdfTowards.create(surface(given), view).pdfSpecular(light);
}
BrdfValue both(GIVEN given, float3 view, float3 light)
{
    return BrdfTowards.create(surface(given), view).evaluate(light);
}
float3 value(GIVEN given, float3 view, float3 light) { return both(given, view, light).total; }
float3 specular(GIVEN given, float3 view, float3 light) { return both(given, view, light).specular; }
"""
