"""Ground, walls, backdrop, light, air and lens: each option changes pictures as documented, and no truth."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

from scenarios.schema.pictures import Light, Picture
from sim.hashing import canonical_hash
from sim.render.camera_view import blur_weights
from sim.render.renderer import Renderer
from sim.render.texture_kernels import facade, lattice_value, poster
from sim.render.weather import rain_drops
from sim.scene.raycast import GROUND, NOTHING, WALL
from sim.types import Array, Scene
from tests.reference_sense import above, crowd, pinhole, small

BUILT = Scene(np.array([16.0, 10.0]), walls=np.array([[[1.0, 9.0], [12.0, 9.5]]]), pillars=np.array([[8.0, 2.5, 0.3]]))
CAMERA = small(pinhole(14.0, at=(8.0, -5.0, 3.0)), 0.5).replace(baseline=0.3)
DARK, CLEAN = Light(shadow=0.0), Picture(noise=0.0, blur_px=0.0)
MOTION = crowd(3, people=10, frames=6, scene=BUILT)

LIGHTS = [
    {"level": 0.5}, {"warmth": 0.2}, {"lamps": 3}, {"lamps": 3, "lamp_share": 0.4}, {"fog": 0.05}, {"wet": 0.7},
    {"rain": 20.0},
]  # fmt: skip
PICTURES = [
    *({"ground": name} for name in ("paving", "tiles", "asphalt", "concrete", "gravel", "grass", "floor")),
    *({"walls": name} for name in ("plaster", "panels", "windows")), {"variety": 2.0}, {"paint": 0.8}, {"stains": 0.8},
    {"ground": "tiles", "grass": False}, {"contrast": 0.5}, {"grey": True}, {"shutter": 0.05}, {"sharpen": 0.5},
]  # fmt: skip


def made(light: Light = DARK, **picture: object) -> Renderer:
    return Renderer(MOTION, CAMERA, light, CLEAN.model_copy(update=picture))


def lit(**light: object) -> Renderer:
    return made(DARK.model_copy(update=light))


PLAIN = made()
KIND, IDS = PLAIN.left_view.geometry.kind, PLAIN.pixels(4).ids


def grey(image: Array) -> Array:
    return image.astype(float).mean(axis=2)


@pytest.mark.parametrize("option", [*LIGHTS, *PICTURES], ids=str)
def test_an_option_changes_pictures_and_no_truth(option: dict[str, object]) -> None:
    other = lit(**option) if option in LIGHTS else made(**option)
    assert canonical_hash(other.pixels(4, disparity=True)) == canonical_hash(PLAIN.pixels(4, disparity=True))
    assert not np.array_equal(other.frame(4), PLAIN.frame(4))
    assert not np.array_equal(other.right(4), PLAIN.right(4))
    assert np.array_equal(other.background(3), PLAIN.background(3)) == ("shutter" in option)  # nobody moves there
    again = lit(**option) if option in LIGHTS else made(**option)
    assert np.array_equal(again.frame(4), other.frame(4))


@pytest.mark.parametrize("option", [{"ground": "concrete"}, {"paint": 0.9}, {"stains": 0.9}], ids=str)
def test_materials_of_the_ground_change_ground_alone(option: dict[str, object]) -> None:
    changed = (made(**option).frame(4) != PLAIN.frame(4)).any(axis=2)
    assert changed[binary_erosion((KIND == GROUND) & (IDS == 0))].mean() > 0.02
    assert not changed[binary_erosion(KIND != GROUND) | (IDS > 0)].any()


def test_walls_change_walls_alone() -> None:
    changed = (made(walls="plaster").frame(4) != PLAIN.frame(4)).any(axis=2)
    assert changed[binary_erosion(KIND == WALL)].mean() > 0.8
    assert not changed[binary_erosion((KIND == GROUND) | (KIND == NOTHING)) | (IDS > 0)].any()


def test_a_facade_is_plaster_with_dark_windows_and_panels_have_joints() -> None:
    wall = binary_erosion(KIND == WALL)
    plaster, windows, panels = (grey(made(walls=name).background(0))[wall] for name in ("plaster", "windows", "panels"))
    assert 0.04 < (windows < 0.8 * plaster).mean() < 0.6
    assert (panels != plaster).mean() > 0.5


def test_paint_is_bright_and_stains_are_mostly_dark() -> None:
    ground, empty = binary_erosion(KIND == GROUND), grey(PLAIN.background(0))
    painted = grey(made(paint=1.0).background(0)) - empty
    assert painted[ground].max() > 30
    assert painted[ground].min() > -3
    assert (grey(made(stains=1.0).background(0)) - empty)[ground].mean() < -1


def test_a_ground_without_grass_is_the_same_everywhere() -> None:
    near = binary_erosion((KIND == GROUND) & (PLAIN.left_view.geometry.depth < 20))

    def spread(name: str, grass: bool) -> float:
        picture = CLEAN.model_copy(update={"ground": "tiles", "grass": grass, "texture": 0.0})
        colour = Renderer(MOTION.replace(name=name), CAMERA, DARK, picture).left_view.empty_scene.colour[near]
        return float(np.ptp(colour[:, 1] / colour[:, 2]))

    lawns, bare = ([spread(f"n{k}", grass) for k in range(8)] for grass in (True, False))
    assert max(bare) < 0.02
    assert sum(one > 0.1 for one in lawns) > 3


def test_doors_and_posters_have_frames_of_the_other_brightness() -> None:
    shown, light, _ = np.transpose([poster(x, 0.91, 7) for x in np.arange(0, 48 * 4.1, 0.01)])
    runs = np.add(np.flatnonzero(np.diff(shown)).reshape(-1, 2), [1, 0])  # first and last place of each
    assert len(runs) > 15
    for first, last in runs:
        middle = light[(first + last) // 2]
        assert abs(middle) > 0
        assert light[[first, first + 6, last - 6, last]] == pytest.approx(-0.4 * middle)
        assert light[[first + 8, last - 8]] == pytest.approx(middle)


def test_downpipes_stand_between_the_windows_of_facades() -> None:
    light = np.array([facade(x, 4.2, 7, 0.01) for x in np.arange(0.5, 200, 0.01)])
    pipe = light == 0.45 * lattice_value(4, 3, 7) - 0.15
    runs = np.flatnonzero(np.diff(pipe)).reshape(-1, 2)
    assert len(runs) > 10
    assert np.diff(runs) * 0.01 == pytest.approx(0.12, abs=0.011)
    wide = 2.6 + lattice_value(0, 3, 7)
    assert ((0.5 + 0.01 * runs.mean(axis=1)) / wide + 0.5) % 1 == pytest.approx(0.5, abs=0.01)


def test_materials_differ_more_with_more_variety() -> None:
    def colours(variety: float) -> Array:
        picture = CLEAN.model_copy(update={"variety": variety, "ground": "asphalt"})
        renderers = [Renderer(MOTION.replace(name=f"n{k}"), CAMERA, DARK, picture) for k in range(40)]
        return np.array([made._materials[0][:, 1] for made in renderers])

    sd = [colours(variety).std(axis=0) for variety in (1.0, 2.0)]
    assert sd[0][0] == pytest.approx(12 * np.hypot(1, 0.3), rel=0.3)
    assert (sd[1] / sd[0])[:5] == pytest.approx(2, rel=0.1)  # the sky is clipped


@pytest.mark.parametrize("kind", ["hedge", "woods", "houses"])
def test_a_backdrop_stands_behind_all_people_and_solids(kind: str) -> None:
    behind = made(backdrop=kind)
    view, pixels = behind.left_view, behind.pixels(4, disparity=True)
    depth, before = view.geometry.depth, PLAIN.left_view.geometry.depth
    shown = depth != before
    assert shown.mean() > 0.02
    assert (view.geometry.kind[shown] == NOTHING).all()
    assert np.array_equal(pixels.ids, IDS)
    place = view.geometry.place[:2, shown].astype(float) - CAMERA.position[:2, None]
    side = np.abs(place).max(axis=0)
    assert np.ptp(side) < 1e-3  # a square round the camera
    assert side.mean() > np.nanmax(np.linalg.norm(MOTION.pos - CAMERA.position[:2], axis=2))
    f, known = CAMERA.focal_px[0] * CAMERA.baseline, shown & np.isfinite(pixels.disparity) & (IDS == 0)
    assert known[shown & (IDS == 0)].mean() > 0.8
    assert np.allclose(pixels.disparity[known], f / depth[known])
    changed = (behind.frame(4) != PLAIN.frame(4)).any(axis=2)
    assert not changed[IDS > 0].any()
    top = small(above(), 0.5)
    flat = [Renderer(MOTION, top, DARK, CLEAN.model_copy(update={"backdrop": b})).frame(4) for b in ("none", kind)]
    assert np.array_equal(*flat)


def test_contrast_falls_in_fog_with_depth() -> None:
    """By exp(-fog depth), for ground and people, to the colour of the sky."""
    fog, depth = 0.06, PLAIN.left_view.geometry.depth.astype(float)
    sky, seen = PLAIN._materials[0][5], PLAIN.pixels(4, disparity=True).disparity
    depth = np.where(IDS > 0, CAMERA.focal_px[0] * CAMERA.baseline / seen, depth)
    kept = np.exp(-fog * depth)[..., None]
    found, clear = lit(fog=fog).frame(4), PLAIN.frame(4).astype(float)
    for pixels in (IDS > 0, binary_erosion((KIND == GROUND) & (depth < 20))):
        here = pixels & np.isfinite(depth)
        assert here.sum() > 200
        assert np.abs(clear * kept + sky * (1 - kept) - found)[here].max() < 2.5


def test_lamps_light_pools_and_the_people_in_them() -> None:
    share, night = 0.8, lit(lamps=3, lamp_share=0.8)
    place = PLAIN.left_view.geometry.place.astype(float)
    lamps = night._materials[1].lamps
    off = np.linalg.norm(place[:2, ..., None] - lamps[:, :2].T[:, None, None], axis=0)
    high = lamps[:, 2]
    wanted = 1 - share + share * np.minimum((high**3 / (high**2 + off**2) ** 1.5).sum(axis=2), 1.5)
    ground = binary_erosion((KIND == GROUND) & (IDS == 0) & (PLAIN.left_view.geometry.depth < 20))
    found, plain = night.frame(4).astype(float), PLAIN.frame(4).astype(float)
    assert np.ptp(wanted[ground]) > 0.3
    assert np.abs(np.minimum(plain * wanted[..., None], 255) - found)[ground].max() < 1.6
    feet = MOTION.pos[3, :, None] - lamps[:, :2]
    for one in np.unique(IDS[IDS > 0]):
        here = (one == IDS) & (plain.min(axis=2) > 20)
        light = 1 - share + share * min((high**3 / (high**2 + (feet[one - 1] ** 2).sum(axis=1)) ** 1.5).sum(), 1.5)
        assert found[here].sum() / plain[here].sum() == pytest.approx(light, abs=0.06)


def test_level_warmth_and_contrast_are_factors() -> None:
    plain = np.minimum(PLAIN.left_view.empty_scene.colour.astype(float), 400)
    for other, wanted in (
        (lit(level=0.5), 0.5 * plain), (lit(warmth=0.2), plain * [0.8, 1.0, 1.2]),
        (made(contrast=0.5), 64 + 0.5 * plain), (made(contrast=1.5), 1.5 * plain - 64),
    ):  # fmt: skip
        assert np.abs(np.clip(wanted, 0, 255) - other.background(0)).max() <= 1


def test_noise_is_not_multiplied_by_contrast() -> None:
    def image(noise: float, contrast: float) -> Array:
        picture = Picture(noise=noise, shot=0.0, texture=0.0, contrast=contrast)
        return Renderer(MOTION, CAMERA, DARK, picture).background(0).astype(float)

    pairs = [(image(4.0, contrast), image(0.0, contrast)) for contrast in (0.4, 1.0)]
    sd = [(noisy - clean)[(clean > 20) & (clean < 235)].std() for noisy, clean in pairs]
    assert sd == pytest.approx([4, 4], rel=0.05)


def test_a_grey_picture_has_equal_channels() -> None:
    image = made(grey=True).frame(4)
    assert (image == image[..., :1]).all()
    assert np.abs(image[..., 0] - PLAIN.frame(4) @ [0.114, 0.587, 0.299]).max() <= 1


def test_an_open_shutter_shows_the_mean_of_five_moments() -> None:
    step = 0.06 / 5
    moved = [
        Renderer(MOTION.replace(pos=MOTION.pos + k * step * MOTION.vel), CAMERA, DARK, CLEAN) for k in range(-2, 3)
    ]
    wanted = np.mean([one.frame(4).astype(float) for one in moved], axis=0)
    assert np.abs(made(shutter=0.06).frame(4) - wanted).max() <= 1
    still = MOTION.replace(vel=np.zeros_like(MOTION.vel))
    one, other = (Renderer(still, CAMERA, DARK, CLEAN.model_copy(update={"shutter": s})) for s in (0.0, 1.0))
    assert np.array_equal(one.frame(4), other.frame(4))


def test_rain_falls_anew_in_each_frame() -> None:
    wet = lit(rain=20.0)
    a, b = ((wet.background(k) != PLAIN.background(k)).any(axis=2) for k in (3, 4))
    height, width = a.shape
    expected = 20 * width * height / 1e4  # streaks, each some 4.5 % of the height long, a tenth of them outside
    assert expected * 0.02 * height < a.sum() < expected * 0.06 * height
    assert (a & b).sum() < 0.3 * a.sum()
    dark = grey(PLAIN.background(3)) < 200
    assert (grey(wet.background(3)) - grey(PLAIN.background(3)))[a & dark].min() > -1


def test_rain_seen_from_above_is_dots() -> None:
    lengths = [rain_drops(20.0, (640, 480), level, (1, 1), 0, 3)[:, 1] for level in (1.0, 0.5, 0.0)]
    assert np.allclose(lengths[1], lengths[0] / 2)
    assert (lengths[2] == 1).all()


def test_a_wet_ground_is_dark_below_and_mirrors_the_sky_afar() -> None:
    ratio = grey(lit(wet=1.0).background(0)) / np.maximum(grey(PLAIN.background(0)), 1)
    ground, depth = binary_erosion(KIND == GROUND), PLAIN.left_view.geometry.depth
    near, far = ratio[ground & (depth < np.quantile(depth[ground], 0.2))], ratio[ground & (depth > 18) & (depth < 35)]
    assert near.mean() < 0.7
    assert far.mean() > 1.1  # the sky is brighter than the dry ground


def test_sharpening_leaves_seams_and_no_change_of_level() -> None:
    weights = blur_weights(0.6, 0.8)
    assert weights.sum() == pytest.approx(1, abs=1e-5)
    step = np.convolve(np.repeat([50.0, 150.0], 30), weights, "same")[10:-10]
    assert step.min() < 48
    assert step.max() > 152
    assert np.array_equal(blur_weights(0.6, 0.0), blur_weights(0.6))
