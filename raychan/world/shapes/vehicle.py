"""Car, SUV and van: bodywork, glass, wheels, mirrors, plate and door handles as named parts."""

from __future__ import annotations

import numpy as np

from raychan.world.meshes.mesh import Floats, Mesh
from raychan.world.shapes.bodywork import Form
from raychan.world.shapes.curve import End
from raychan.world.shapes.piece import BODY_SAG, Assembly, Piece
from raychan.world.shapes.solid import capsule, ellipsoid, pillar, rounded_block

_UPRIGHT_TO_Y = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
_PLATE = (0.52, 0.11, 0.004)  # m: width, height and half thickness of the number plate
_FLANK = np.radians(8.0)  # turn of a passenger car's flanks above and below their widest point


def car(
    length: float = 4.4, width: float = 1.8, height: float = 1.45, metal: str = "metal", max_sag: float = BODY_SAG
) -> Mesh:
    """Return a four-door saloon; sizes [m] are overall, without the mirrors; `metal` names the bodywork's material.

    Origin: centre of the footprint on the ground; front = +x.
    Allowed: `length` 2.8 to 66 m and `width` 0.72 to 2.38 m, each with the other sizes as they are.
    Parts: tail, rear_bumper, front, front_bumper, hood, boot, roof, pillars, quarter_*, rear_door_* and front_door_*
    (with seams and handles), fender_*, window_*, windscreen, mirror_*, tyre_*, rim_*, plate, floor, cabin, seats.
    Defaults: a European C-segment saloon.
    """
    x, z = length / 4.4, height / 1.45
    form = Form(
        length, width, height, clearance=0.18 * z, belt=0.95 * z, nose_drop=0.24, tail_drop=0.04, bonnet=3.05 * x,
        boot=0.9 * x, rear=End(3.2, 0.24), front=End(2.4, 0.32), bulge=_FLANK, cabin=(0.45 * x, 3.3 * x),
        lean=(0.6 * x, 0.85 * x, 0.15), wheelbase=2.62 * x, rear_overhang=0.92 * x, wheel_radius=0.32 * z,
        doors=(1.05 * x, 1.95 * x, 3.05 * x), panes=((0.62 * x, 0.9 * x), (1.0 * x, 1.9 * x), (2.0 * x, 2.95 * x)),
    )  # fmt: skip
    return _vehicle(form, metal, max_sag)


def suv(
    length: float = 4.7, width: float = 1.9, height: float = 1.75, metal: str = "metal", max_sag: float = BODY_SAG
) -> Mesh:
    """Return an SUV; sizes [m] are overall, without the mirrors; `metal` names the bodywork's material.

    Origin: centre of the footprint on the ground; front = +x.
    Allowed: `length` 3.25 to 73 m and `width` 0.69 to 2.45 m, each with the other sizes as they are.
    Parts as `car`. Defaults: a European mid-size SUV.
    """
    x, z = length / 4.7, height / 1.75
    form = Form(
        length, width, height, clearance=0.20 * z, belt=1.12 * z, nose_drop=0.14, tail_drop=0.0, bonnet=3.5 * x,
        boot=0.5 * x, rear=End(3.5, 0.22), front=End(2.8, 0.3), bulge=_FLANK, cabin=(0.07 * x, 3.55 * x),
        lean=(0.4 * x, 0.75 * x, 0.16), wheelbase=2.75 * x, rear_overhang=0.97 * x, wheel_radius=0.36 * z,
        doors=(1.2 * x, 2.2 * x, 3.3 * x), panes=((0.35 * x, 1.0 * x), (1.1 * x, 2.1 * x), (2.25 * x, 3.2 * x)),
    )  # fmt: skip
    return _vehicle(form, metal, max_sag)


def van(
    length: float = 5.9, width: float = 2.0, height: float = 2.6, metal: str = "metal", max_sag: float = BODY_SAG
) -> Mesh:
    """Return a panel van; sizes [m] are overall, without the mirrors; `metal` names the bodywork's material.

    Origin: centre of the footprint on the ground; front = +x.
    Allowed: `length` 3.1 to 80 m and `width` 0.71 to 2.9 m, each with the other sizes as they are.
    Parts as `car`; only the front doors and the rear have windows. Defaults: a European large van with a high roof.
    """
    x, z = length / 5.9, height / 2.6
    form = Form(
        length, width, height, clearance=0.2 * z, belt=1.25 * z, nose_drop=0.22, tail_drop=0.0, bonnet=4.9 * x,
        boot=0.5 * x, rear=End(5.0, 0.15), front=End(2.6, 0.3), bulge=np.radians(5.0), cabin=(0.05 * x, 5.25 * x),
        lean=(0.06 * x, 0.95 * x, 0.12), wheelbase=3.65 * x, rear_overhang=1.2 * x, wheel_radius=0.35 * z,
        doors=(2.6 * x, 3.85 * x, 4.85 * x), panes=((3.95 * x, 4.75 * x),),
    )  # fmt: skip
    return _vehicle(form, metal, max_sag)


def _vehicle(form: Form, metal: str, sag: float) -> Mesh:
    made = Assembly()
    _tub(made, form, metal, sag)
    _cabin(made, form, metal, sag)
    _seats(made, form, sag)
    _wheels(made, form, metal, sag)
    _doors(made, form, metal, sag)
    _plate(made, form, sag)
    made.pieces[:] = [(name, p.moved(offset=(-0.5 * form.length, 0.0, 0.0))) for name, p in made.pieces]
    return made.mesh()


def _tub(made: Assembly, form: Form, metal: str, sag: float) -> None:
    tub = form.tub(sag)
    centre, facing = tub.centres(), tub.facing()
    x, z, ahead, up = centre[:, 0], centre[:, 2], facing[:, 0], facing[:, 2]
    low = z < form.clearance + 0.3 * (form.belt - form.clearance)
    flank = [0.0, *form.doors, form.length]
    sides = ("quarter", "rear_door", "front_door", "fender")
    label = np.full(len(x), "", dtype=object)
    for name, start, stop in zip(sides, flank[:-1], flank[1:], strict=True):
        here = (x >= start) & (x < stop)
        label[here & (centre[:, 1] >= 0.0)] = f"{name}_left"
        label[here & (centre[:, 1] < 0.0)] = f"{name}_right"
    label[(ahead < -0.5) & (x < 0.5 * form.doors[0])] = "tail"
    label[(ahead > 0.5) & (x > form.bonnet)] = "front"
    label[(label == "tail") & low] = "rear_bumper"
    label[(label == "front") & low] = "front_bumper"
    label[up < -0.9] = "floor"
    label[(up > 0.75) & (x > 0.5 * (form.cabin[0] + form.cabin[1]))] = "hood"
    label[(up > 0.75) & (x <= 0.5 * (form.cabin[0] + form.cabin[1]))] = "boot"
    for name in dict.fromkeys(label):
        made.add(name, metal, tub.where(label == name))


def _cabin(made: Assembly, form: Form, metal: str, sag: float) -> None:
    shell, place = form.cabin_shell(sag)
    x, pane, ahead = place.T
    left = shell.centres()[:, 1] >= 0.0
    label = np.full(len(x), "roof", dtype=object)
    label[(shell.facing()[:, 2] < 0.7)] = "pillars"
    label[(pane > 0) & (ahead > 0.85)] = "windscreen"
    if form.rear_window:
        label[(pane > 0) & (ahead < -0.85)] = "window_rear"
    for i, (start, stop) in enumerate(form.panes):
        here = (pane > 0) & (np.abs(ahead) < 0.3) & (x > start) & (x < stop)
        label[here & left], label[here & ~left] = f"window_{i + 1}_left", f"window_{i + 1}_right"
    glass = {name: "car_glass" for name in label if name.startswith("window")} | {"windscreen": "windscreen"}
    for name in dict.fromkeys(label):
        made.add(name, glass.get(name, metal), shell.where(label == name))


def _seats(made: Assembly, form: Form, sag: float) -> None:
    """Backs and head rests that rise above the belt line, seen through the panes."""
    room = min(form.height - form.belt, 0.75)
    coarse = 5.0 * sag
    low, high = form.cabin
    deck = rounded_block(high - low - 0.57, form.width - 0.45, 0.06, 0.02, coarse)
    made.add("cabin", "foam", deck.moved(offset=(0.5 * (low + high) - 0.015, 0.0, form.belt - 0.05)))
    front = form.panes[-1][0] + 0.1
    rows: list[tuple[float, tuple[float, ...]]] = [(front, (-0.36, 0.36))]
    if len(form.panes) > 1:
        rows.append((form.panes[-2][0] + 0.15, (-0.45, 0.0, 0.45)))
    for x, places in rows:
        for y in places:
            wide = 0.46 if len(places) == 2 else 0.42
            back = rounded_block(0.14, wide, 0.52 * room, 0.05, coarse).moved(offset=(x, y, form.belt - 0.03))
            rest = rounded_block(0.09, 0.26, 0.26 * room, 0.04, coarse).moved(offset=(x, y, form.belt + 0.50 * room))
            made.add("seats", "foam", back, rest)


def _wheels(made: Assembly, form: Form, metal: str, sag: float) -> None:
    for end, x in (("rear", form.rear_overhang), ("front", form.rear_overhang + form.wheelbase)):
        tyre, rim = wheel(form.wheel_radius, 0.21, 0.5 * form.width - 2e-3, 2.5 * sag)
        for part, material, piece in ((f"tyre_{end}", "rubber", tyre), (f"rim_{end}", metal, rim)):
            made.pair(part, material, piece.moved(offset=(x, 0.0, 0.0)))


def wheel(radius: float, width: float, outside: float, sag: float) -> tuple[Piece, Piece]:
    """Return tyre and rim of a left wheel on the ground at x = 0 whose outer face lies at y = outside [m]."""
    proud = 6e-3
    tyre = pillar(radius, width, 0.035, sag).moved(_UPRIGHT_TO_Y, (0.0, outside - proud, radius))
    disc = pillar(0.64 * radius, width, 0.02, sag).moved(_UPRIGHT_TO_Y, (0.0, outside, radius))
    return tyre, disc


def _doors(made: Assembly, form: Form, metal: str, sag: float) -> None:
    z = form.belt - 0.17 * (form.belt - form.clearance)
    thick = 0.014
    for name, x in (("rear_door", form.doors[0] + 0.17), ("front_door", form.doors[1] + 0.17)):
        # Proud of the skin, but not wider than the vehicle.
        y = min(form.side(x, z) + 0.012, 0.5 * form.width - thick)
        made.pair(name, metal, capsule(_at(x - 0.09, y, z), _at(x + 0.09, y, z), thick, thick, 2.0 * sag))
    x, z = form.doors[2] - 0.12, form.belt + 0.06
    y = form.side(x, form.belt - 0.1) + 0.11
    house = ellipsoid((0.06, 0.11, 0.085), 2.0 * sag).moved(offset=(x, y, z))
    arm = capsule(_at(x, y - 0.2, z - 0.08), _at(x, y - 0.05, z - 0.03), 0.022, 0.02, 2.0 * sag)
    made.pair("mirror", metal, house, arm)


def _plate(made: Assembly, form: Form, sag: float) -> None:
    wide, tall, thick = _PLATE
    z = form.clearance + 0.72 * (form.belt - form.clearance)
    x = form.inset(0.0, z) - thick
    lean = np.arctan2(form.inset(0.0, z + 0.05) - form.inset(0.0, z - 0.05), 0.1)
    turn = np.array([[np.cos(lean), 0.0, np.sin(lean)], [0.0, 1.0, 0.0], [-np.sin(lean), 0.0, np.cos(lean)]])
    sheet = rounded_block(2.0 * thick, wide, tall, 0.3 * thick, sag).moved(offset=(thick, 0.0, -0.5 * tall))
    sheet = sheet.moved(turn)
    # Proud of the tail, but never behind the vehicle's own length.
    made.add("plate", "metal", sheet.moved(offset=(max(x, -float(sheet.vertices[:, 0].min())), 0.0, z)))


def _at(x: float, y: float, z: float) -> Floats:
    return np.array([x, y, z])
