"""Which whole frames are golden: presets, every mode of every effect, and what makes histories hard to keep."""

import pica
from pica.scene.camera import Camera
from pica.scenes import cornell, corridor, court, machine_world, rooms, showroom, sphere_grid
from tests.building import CAMERA, still_life
from tests.golden import scenes
from tests.golden.comparison import Limits
from tests.golden.scenes import VIEW
from tests.golden.whole_frames import WholeFrame, orbit


def swing(scene: pica.Scene, camera: Camera, frame: int, frames: int) -> Camera:
    """Bars bend, a ball rolls and the camera sways, at 15 frames a second."""
    scenes.swing(scene, frame / 15)
    return scene.default_camera(1.0)


PREFILTERED = {"lighting.environment": "prefiltered"}
ORDER = "surfels take their numbers, and so their noise, in the order of threads"
BAKED = "the light map is baked on the card itself, from 64 samples a probe"
SURFELS = {"global_illumination.mode": "surfels"}
NOISY = Limits(flip=0.03, energy=0.02)
"""For pictures of few samples: other noise is far off."""

PRESETS = [
    WholeFrame("default_glass_world_orbit", machine_world, motion=orbit, on_cards=NOISY),
    WholeFrame("default_machine_world", scenes.opaque_world),
    WholeFrame("default_machine_world_orbit", scenes.opaque_world, motion=orbit, on_cards=NOISY, always=True),
    WholeFrame("default_machine_world_display", scenes.opaque_world, frames=2, display=True),
    WholeFrame("default_corridor", corridor),
    WholeFrame("default_corridor_orbit", corridor, motion=orbit, on_cards=NOISY, always=True),
    WholeFrame("default_rooms", rooms),
    WholeFrame("default_rooms_orbit", rooms, motion=orbit, on_cards=NOISY),
    WholeFrame("default_cornell_first", cornell, frames=1, on_cards=NOISY, always=True),
    WholeFrame("default_still_life_orbit", still_life, motion=orbit, camera=CAMERA, on_cards=NOISY),
    WholeFrame("default_bent_swing", scenes.bent, motion=swing, on_cards=NOISY, always=True),
    WholeFrame("default_coloured_glass", scenes.coloured_glass, camera=VIEW),
    WholeFrame("default_crowded_light_orbit", scenes.crowded_light, motion=orbit, camera=VIEW, on_cards=NOISY),
    WholeFrame("default_sphere_grid", sphere_grid, frames=8),
    WholeFrame("default_showroom", showroom, on_cards=NOISY),
    WholeFrame("default_landscape", scenes.landscape, frames=4, on_cards=NOISY),
    WholeFrame(
        "performance_machine_world_orbit", scenes.opaque_world, motion=orbit, preset="performance", on_cards=NOISY
    ),
    WholeFrame("balanced_rooms", rooms, preset="balanced"),
    WholeFrame("cinematic_machine_world_orbit", scenes.opaque_world, motion=orbit, preset="cinematic", on_cards=NOISY),
    WholeFrame("cinematic_corridor", corridor, preset="cinematic"),
    WholeFrame("raster_machine_world_orbit", scenes.opaque_world, motion=orbit, preset="raster", always=True),
    WholeFrame(
        "pica_pica_glass_world_orbit", machine_world, motion=orbit, preset="pica_pica", one_thread=True, differs=ORDER
    ),
    WholeFrame("ue4_reflections_corridor_orbit", corridor, motion=orbit, preset="ue4_reflections", on_cards=NOISY),
    WholeFrame(
        "ue4_speed_of_light_corridor_orbit", corridor, motion=orbit, preset="ue4_speed_of_light", on_cards=NOISY
    ),
    WholeFrame("raster_rooms_light_map", rooms, preset="raster", map_spacing=1.0, differs=BAKED),
]

REFLECTIONS = [
    WholeFrame("reflections_off", corridor, {"reflections.mode": "off"}),
    WholeFrame("reflections_screen_space_orbit", corridor, {"reflections.mode": "screen_space"}, orbit, on_cards=NOISY),
    WholeFrame(
        "reflections_area_lights_orbit",
        scenes.under_lamps,
        {"reflections.area_lights": "true"},
        orbit,
        camera=VIEW,
        on_cards=NOISY,
        always=True,
    ),
    WholeFrame(
        "reflections_two_bounces_mirror_rays",
        corridor,
        {"reflections.bounces": "2", "reflections.reconstruction": "mirror_rays"},
    ),
]

INDIRECT = [
    WholeFrame("indirect_restir", rooms, {"global_illumination.mode": "restir"}),
    WholeFrame(
        "indirect_restir_orbit", rooms, {"global_illumination.mode": "restir"}, orbit, on_cards=NOISY, always=True
    ),
    WholeFrame("indirect_surfels", rooms, SURFELS, on_cards=NOISY, one_thread=True, differs=ORDER),
    WholeFrame(
        "indirect_surfels_orbit", rooms, SURFELS, orbit, on_cards=NOISY, one_thread=True, differs=ORDER, always=True
    ),
    WholeFrame(
        "indirect_light_map",
        rooms,
        {"global_illumination.mode": "light_map"},
        map_spacing=1.0,
        differs=BAKED,
        always=True,
    ),
    WholeFrame("indirect_path_traced_light_map_orbit", rooms, motion=orbit, map_spacing=1.0, on_cards=NOISY),
    WholeFrame("indirect_court", court, motion=orbit, on_cards=NOISY),
]

SHADOWS = [
    WholeFrame(
        "shadows_svgf_orbit",
        scenes.under_lamps,
        {"shadows": "high", "shadows.denoiser": "svgf"},
        orbit,
        camera=VIEW,
        on_cards=NOISY,
    ),
    WholeFrame(
        "shadows_anisotropic_orbit", scenes.under_lamps, {"shadows": "high"}, orbit, camera=VIEW, on_cards=NOISY
    ),
    WholeFrame(
        "shadows_unfiltered",
        scenes.under_lamps,
        {"shadows": "high", "shadows.denoiser": "off"},
        camera=VIEW,
        on_cards=NOISY,
    ),
    WholeFrame("shadows_hard", scenes.under_a_sky, {"shadows.mode": "hard"}, camera=VIEW),
    WholeFrame("shadows_maps_orbit", scenes.opaque_world, {"shadows.method": "maps"}, orbit, on_cards=NOISY),
    WholeFrame("shadows_maps_lamps", scenes.under_lamps, {"shadows.method": "maps"}, camera=VIEW),
    WholeFrame(
        "lamps_ratio_estimator",
        scenes.under_lamps,
        {"shadows": "high", "lighting.area_shadows": "ratio_estimator"},
        camera=VIEW,
        on_cards=NOISY,
    ),
]

OCCLUSION = [
    WholeFrame(
        "occlusion_rays_orbit",
        scenes.under_a_sky,
        {**PREFILTERED, "ambient_occlusion.mode": "ray_traced"},
        orbit,
        camera=VIEW,
        on_cards=NOISY,
    ),
    WholeFrame(
        "occlusion_horizons_orbit",
        scenes.under_a_sky,
        {**PREFILTERED, "ambient_occlusion.mode": "ground_truth"},
        orbit,
        camera=VIEW,
        on_cards=NOISY,
    ),
]

VISIBILITY = [
    WholeFrame("primary_raster", scenes.opaque_world, {"visibility.primary": "raster"}, frames=2),
    WholeFrame("primary_rays", scenes.opaque_world, {"visibility.primary": "rays"}, frames=2),
    WholeFrame("rays_pipeline", cornell, {"rays.scheduler": "pipeline"}, frames=4),
    WholeFrame("transparent_background", still_life, {"visibility.background": "transparent"}, frames=4, camera=CAMERA),
    WholeFrame("accumulate_orbit", corridor, {"antialiasing.mode": "accumulate"}, orbit, on_cards=NOISY),
    WholeFrame("upscale", scenes.opaque_world, {"antialiasing.upscale": "1.5"}),
    WholeFrame(
        "upscale_orbit",
        scenes.opaque_world,
        {"antialiasing.upscale": "1.5", "antialiasing.sharpness": "0.5"},
        orbit,
        on_cards=NOISY,
    ),
]

WHOLE_FRAMES = [*PRESETS, *REFLECTIONS, *INDIRECT, *SHADOWS, *OCCLUSION, *VISIBILITY]
