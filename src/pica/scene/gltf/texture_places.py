"""Where materials have textures."""

_MATERIALS = "extensions/KHR_materials_"
SPECULAR_GLOSSINESS = "KHR_materials_pbrSpecularGlossiness"

TEXTURES = {
    "pbrMetallicRoughness/baseColorTexture": "base_color_texture",
    "pbrMetallicRoughness/metallicRoughnessTexture": "metallic_roughness_texture",
    "normalTexture": "normal_texture",
    "occlusionTexture": "occlusion_texture",
    "emissiveTexture": "emissive_texture",
    f"{_MATERIALS}anisotropy/anisotropyTexture": "anisotropy_texture",
    f"{_MATERIALS}clearcoat/clearcoatTexture": "coat_texture",
    f"{_MATERIALS}clearcoat/clearcoatRoughnessTexture": "coat_roughness_texture",
    f"{_MATERIALS}clearcoat/clearcoatNormalTexture": "coat_normal_texture",
    f"{_MATERIALS}diffuse_transmission/diffuseTransmissionTexture": "diffuse_transmission_texture",
    f"{_MATERIALS}diffuse_transmission/diffuseTransmissionColorTexture": "diffuse_transmission_color_texture",
    f"{_MATERIALS}iridescence/iridescenceTexture": "iridescence_texture",
    f"{_MATERIALS}iridescence/iridescenceThicknessTexture": "iridescence_thickness_texture",
    f"{_MATERIALS}sheen/sheenColorTexture": "sheen_color_texture",
    f"{_MATERIALS}sheen/sheenRoughnessTexture": "sheen_roughness_texture",
    f"{_MATERIALS}specular/specularTexture": "specular_texture",
    f"{_MATERIALS}specular/specularColorTexture": "specular_color_texture",
    f"{_MATERIALS}transmission/transmissionTexture": "transmission_texture",
}
"""Texture infos of materials."""
SPECULAR_GLOSSINESS_TEXTURES = (
    f"extensions/{SPECULAR_GLOSSINESS}/diffuseTexture",
    f"extensions/{SPECULAR_GLOSSINESS}/specularGlossinessTexture",
)
"""Those that become textures of metallic-roughness."""
