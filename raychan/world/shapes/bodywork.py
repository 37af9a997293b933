"""Bodywork of a vehicle: the lower body up to the belt line and the glazed cabin on it, curved in plan and section."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from raychan.world.meshes.mesh import Floats
from raychan.world.shapes.curve import Curve, End, arcs, half_outline, split_at
from raychan.world.shapes.piece import Bend, Piece
from raychan.world.shapes.solid import offset_solid


@dataclass(frozen=True)
class Form:
    """Proportions of a passenger vehicle [m], x measured from its rear; overall size excludes the mirrors."""

    length: float
    width: float
    height: float
    clearance: float
    belt: float
    """Largest height of the lower body."""
    nose_drop: float
    """Share of the lower body's height lost at the nose (bonnet); `tail_drop` at the tail (boot)."""
    tail_drop: float
    bonnet: float
    """x where the bonnet begins to fall."""
    boot: float
    rear: End
    front: End
    bulge: float
    """Turn [rad] of the flanks from the belt to the widest point and from there to the sill."""
    cabin: tuple[float, float]
    """x of the lower edges of rear window and windscreen."""
    lean: tuple[float, float, float]
    """How far rear window, windscreen and sides lean in from belt to roof."""
    wheelbase: float
    rear_overhang: float
    wheel_radius: float
    doors: tuple[float, ...]
    """x of the upright seams, from the rear."""
    panes: tuple[tuple[float, float], ...]
    """x from and to of each side window, from the rear."""
    rear_window: bool = True
    seam: tuple[float, float] = field(default=(4e-3, 8e-3))
    """Width and depth of the door seams."""

    def _section(self, sag: float) -> Curve:
        """Return the lower body's section (x <= 0: inset from the plan outline; z), of full height."""
        b, foot, shoulder = self.bulge, 0.10, 0.06
        tall = self.belt - self.clearance - (foot + shoulder) * (1.0 - np.sin(b))
        flank = tall / (2.0 * np.sin(b))
        quarter = np.pi / 2.0
        curve = arcs([(foot, quarter - b), (flank, b), (flank, b), (shoulder, quarter - b)], -quarter, sag)
        return curve.shifted(-curve.points[:, 0].max(), self.clearance)

    def tub(self, sag: float) -> Piece:
        """Return the closed lower body with its door seams, x from 0 (rear) to length."""
        plan = half_outline(self.length, self.width, self.rear, self.front, sag)
        flank = plan.points[np.abs(plan.normals[:, 1]) > 0.95, 0]
        for drop, start, stop in ((self.nose_drop, self.bonnet, flank[-1]), (self.tail_drop, self.boot, flank[0])):
            # The fall towards nose and tail curves the flank's upper edge, which needs more columns than the plan.
            run = self.length - self.bonnet if stop > start else self.boot
            radius = run**2 / (2.0 * max(drop, 1e-6) * (self.belt - self.clearance))
            count = int(abs(stop - start) / np.sqrt(8.0 * radius * sag)) + 1
            for x in np.linspace(start, stop, count + 1)[:-1]:
                if np.abs(plan.points[:, 0] - x).min() > 0.01 and np.abs(np.subtract(self.doors, x)).min() > 0.01:
                    plan, _ = split_at(plan, float(x))
        grooves = {x: self.seam for x in self.doors}
        return offset_solid(plan, self._section(sag), grooves).bent(self.fall)

    def fall(self, p: Floats) -> tuple[Floats, Floats]:
        """Map that lowers the body towards nose and tail."""
        g, slope = self.falling(p[:, 0])
        q, jacobian = p.copy(), np.tile(np.eye(3), (len(p), 1, 1))
        q[:, 2] = self.clearance + (p[:, 2] - self.clearance) * g
        jacobian[:, 2, 2] = g
        jacobian[:, 2, 0] = (p[:, 2] - self.clearance) * slope
        return q, jacobian

    def falling(self, x: Floats) -> tuple[Floats, Floats]:
        """Return the lower body's height at x over its largest height, and the slope of this ratio [1/m]."""
        ahead, behind = self.length - self.bonnet, self.boot
        # Parabolas: no kink where they start, convex all along.
        nose = np.maximum((x - self.bonnet) / ahead, 0.0)
        tail = np.maximum((self.boot - x) / behind, 0.0)
        g = 1.0 - self.nose_drop * nose**2 - self.tail_drop * tail**2
        return g, -2.0 * self.nose_drop * nose / ahead + 2.0 * self.tail_drop * tail / behind

    def inset(self, x: float, z: float) -> float:
        """Return the distance [m] of the lower body's skin at (x, z) from the plan outline, inwards."""
        g = float(self.falling(np.array([x]))[0][0])
        section = self._section(0.1e-3)
        return -float(np.interp(self.clearance + (z - self.clearance) / g, section.points[:, 1], section.points[:, 0]))

    def side(self, x: float, z: float) -> float:
        """Return the distance [m] of the lower body's flank at (x, z) from the middle plane."""
        plan = half_outline(self.length, self.width, self.rear, self.front, 0.1e-3)
        flank = np.abs(plan.normals[:, 1]) > 0.7
        return float(np.interp(x, plan.points[flank, 0], -plan.points[flank, 1])) - self.inset(x, z)

    def cabin_shell(self, sag: float) -> tuple[Piece, Floats]:
        """Return the closed cabin and for each face x, whether it is in the row of panes, and x of its plan normal."""
        low, high = self.cabin
        foot, long, tall = self.belt - 0.08, high - low, self.height - self.belt + 0.08
        wide = self.width - 0.12
        plan = half_outline(long, wide, End(3.0, 0.16, np.radians(1.0)), End(2.2, 0.2, np.radians(1.0)), sag)
        for x in sorted({x - low for pane in self.panes for x in pane}):
            plan, _ = split_at(plan, x)
        sill, rail, roof = 0.13, 0.08, 0.09
        pane = tall - sill - rail - roof
        elements = [(np.inf, sill), (np.inf, pane), (np.inf, rail), (roof, np.pi / 2.0)]
        raw = offset_solid(plan, arcs(elements, 0.0, sag)).moved(offset=(low, 0.0, foot))
        place = np.column_stack([raw.centres()[:, [0, 2]], raw.facing()[:, 0]])
        pane_rows = np.abs(place[:, 1] - (foot + sill + 0.5 * pane)) < 0.45 * pane
        flat = np.abs(raw.facing()[:, 2]) < 0.01
        place[:, 1] = pane_rows & flat
        return raw.bent(self._leaning(low, long, foot, tall, wide)), place

    def _leaning(self, low: float, long: float, foot: float, tall: float, wide: float) -> Bend:
        rear, front, side = self.lean
        taper = side / (0.5 * wide)

        def bend(p: Floats) -> tuple[Floats, Floats]:
            s, along = (p[:, 2] - foot) / tall, (p[:, 0] - low) / long
            shift = rear * (1.0 - along) - front * along
            q, j = p.copy(), np.tile(np.eye(3), (len(p), 1, 1))
            q[:, 0] += s * shift
            q[:, 1] *= 1.0 - s * taper
            j[:, 0, 0] = 1.0 - s * (rear + front) / long
            j[:, 0, 2] = shift / tall
            j[:, 1, 1] = 1.0 - s * taper
            j[:, 1, 2] = -p[:, 1] * taper / tall
            return q, j

        return bend
