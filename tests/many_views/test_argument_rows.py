"""Slang files with rows of arguments: what becomes of parameters and entry points, as text."""

from pica.many_views.argument_rows import entry_with_rows, package_with_rows

FILES = {
    "blur/taps.slang": "module taps;\npublic Texture2D<float4> source; // read\nuniform uint2 size;\n",
    "frame/constants.slang": (
        "module constants;\npublic struct Constants { public uint index; public Texture2D<uint> cut; }\n"
        "public ParameterBlock<Constants> frame;\n"
    ),
    "scene.slang": "module scene;\npublic ParameterBlock<SceneData> scene;\n",
    "cache.slang": "module cache;\nimport frame.constants;\nuint entries;\n",
}
ENTRY = """import blur.taps;
import scene;
RWTexture2D<float4> target;
StructuredBuffer<float> weights; // of taps
Texture2D<float> levels[COUNT];
float rise, fall;
SamplerState linear;
static const float half = .5;
float weigh(StructuredBuffer<float> of, uint tap) { float sum; return of[tap]; }
[shader("compute")]
[numthreads(8, 8, 1)]
void main(uint3 thread : SV_DispatchThreadID, uint index : SV_GroupIndex) { target[thread.xy] = weights[0]; }
"""


def test_parameters_become_variables_of_the_same_names():
    text = entry_with_rows(ENTRY, FILES)
    assert "static DescriptorHandle<RWTexture2D<float4>> targetToWrite; property RWTexture2D<float4> target {" in text
    assert "static float* weights; // of taps" in text
    assert "static LevelsHandles levels;" in text and "DescriptorHandle<Texture2D<float>> of[COUNT];" in text
    assert "static float rise; static float fall;" in text
    assert "float weigh(float* of, uint tap) { float sum; return of[tap]; }" in text
    for unchanged in ("\nSamplerState linear;", "static const float half = .5;", "target[thread.xy] = weights[0]; }"):
        assert unchanged in text


def test_an_entry_point_takes_all_from_the_row_of_its_view():
    text = entry_with_rows(ENTRY, FILES)
    assert "{ takeArguments(argumentPlace.x + thread.z / argumentPlace.y); thread.z %= argumentPlace.y;" in text
    assert "struct ArgumentRow { Row of; RowBlurTaps ofBlurTaps; }" in text
    assert "take(row.of, view); takeBlurTaps(row.ofBlurTaps, view);" in text
    assert "import blur.taps;\nimport tracing.view_number;\nstruct ArgumentRow" in text, (
        "what `main` imports has no row"
    )


def test_an_entry_point_without_numbers_of_threads_gets_that_of_its_group():
    text = entry_with_rows('uint bins;\n[shader("compute")] [numthreads(1, 1, 1)] void main() { bins; }\n', {})
    assert "void main(uint3 viewGroup : SV_GroupID) { takeArguments(argumentPlace.x + viewGroup.z" in text


def test_ray_generation_finds_its_view_in_the_third_number():
    text = entry_with_rows('uint part;\n[shader("raygeneration")]\nvoid main()\n{\n}\n', {})
    assert "viewNumber = argumentPlace.x + DispatchRaysIndex().z; takeArguments(viewNumber);" in text


def test_implementations_that_are_linked_have_their_arguments_in_the_row_too():
    text = entry_with_rows(ENTRY, FILES, "cache.slang")
    assert "import cache;" in text and "takeCache(row.ofCache, view);" in text
    assert "takeFrameConstants(view);" in text, "of what they import"


def test_blocks_of_views_become_variables_and_those_of_the_scene_stay(tmp_path):
    package, folder = tmp_path / "package", tmp_path / "rows"
    for name, text in FILES.items():
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text(text)
    package_with_rows(package, folder)
    constants = (folder / "frame/constants.slang").read_text()
    assert "public static Constants frame; public StructuredBuffer<Constants> frameRows;" in constants
    assert "public DescriptorHandle<Texture2D<uint>> cutToRead; public property Texture2D<uint> cut {" in constants
    assert "public void takeFrameConstants(uint view) { frame = frameRows[view]; }" in constants
    assert (folder / "scene.slang").read_text() == FILES["scene.slang"]
    taps = (folder / "blur/taps.slang").read_text()
    assert "static uint2 size;" in taps and "public property Texture2D<float4> source" in taps
    entries = (folder / "cache.slang").read_text()
    assert "public" not in entries, "where nothing is, Slang makes all public"
