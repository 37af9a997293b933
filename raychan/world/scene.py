"""The scene: bodies, a radar and settings, from a TOML file or from Python; facets and targets at any time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy, deepcopy
from dataclasses import replace
from functools import cached_property
from operator import is_
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from raychan.records import LAYER, Facets, Points
from raychan.reprs import Described
from raychan.scalars import plain
from raychan.world import array_checks, checks, overlaps
from raychan.world.body import Body
from raychan.world.errors import SceneError, shown
from raychan.world.fixed import Fixed
from raychan.world.later import check_later, check_time, table_at
from raychan.world.limits import FREQUENCY
from raychan.world.material import Material, validity
from raychan.world.meshes.mesh import Floats
from raychan.world.meshes.topology import MeshTopology
from raychan.world.posed import index_of, materials_chosen, points_of, posed, spheres_inside
from raychan.world.scene_arguments import bodies_of, check_texts, materials_of
from raychan.world.scene_files import overrides
from raychan.world.scene_files.build import body_of, material_of, refuse_ship, scene_text
from raychan.world.scene_files.errors import checked
from raychan.world.scene_files.idle_keys import idle_keys
from raychan.world.scene_files.impairments import AtmosphereTable
from raychan.world.scene_files.radar_mount import mount, processing_of, radar_of
from raychan.world.scene_files.schema import PREVIEW, BodyTable, InterfererTable, Model, RadarTable, SceneFile
from raychan.world.seams import over_seams
from raychan.world.static_geometry import StaticGeometry
from raychan.world.surroundings import atmosphere_of, attenuation_of, check_places, interferers_of

if TYPE_CHECKING:
    from raychan.em.atmosphere import Atmosphere
    from raychan.radar.interferer import Interferer
    from raychan.radar.processing import Processing
    from raychan.radar.radar import Radar

__all__ = ["Body", "Scene", "SceneError"]


class Scene(Fixed, Described):
    """Bodies, materials, a radar and settings.

    Args: bodies; frequency [Hz] (default the radar's carrier, or 77 GHz), also of the materials if given (default the
    middle of the ramp); radar an object, a table as in a scene file, or None; processing of the receiver, an object or
    a table (default the radar's own); model a table of what is modelled; materials by name, which bodies may use;
    folder to which file names refer; atmosphere, an object or a table (default none: no loss on the way); interferers.
    Raises: SceneError for a scene that cannot be.

    >>> Scene(bodies=[Body(name="wall", shape="plate", position=(10, 0, 0))]).frequency
    77000000000.0
    """

    def __init__(
        self,
        bodies: Iterable[Body] = (),
        frequency: float | None = None,
        radar: Radar | RadarTable | Mapping[str, object] | None = None,
        processing: Processing | Mapping[str, object] | None = None,
        model: Model | Mapping[str, object] | None = None,
        materials: Mapping[str, Material] | None = None,
        title: str = "",
        text: str = "",
        path: Path | None = None,
        folder: Path | None = None,
        atmosphere: Atmosphere | AtmosphereTable | Mapping[str, object] | None = None,
        interferers: Iterable[Interferer | InterfererTable | Mapping[str, object]] = (),
    ) -> None:
        check_texts(title=title, text=text, path=path, folder=folder)
        self.title, self.text, self.path = title, text, path
        self.folder = folder or Path.cwd()
        self._given, self.bodies = bodies_of(bodies, path)
        self.radar_table: RadarTable | None = mount(radar, path)
        self.processing: Processing = processing_of(processing, radar, path)
        self.is_radar_object = not isinstance(radar, RadarTable | Mapping | None)
        if not isinstance(radar, RadarTable | Mapping | None):
            self.__dict__["radar"] = replace(radar, processing=self.processing)
        self.model: Model = checked(Model, Model() if model is None else model, path, "model")
        carrier = self.radar_table.waveform.carrier_ghz * 1e9 if self.radar_table else 77e9
        if frequency is not None and FREQUENCY.problem(frequency):
            problem, allowed = f"{shown(frequency)} is not possible", FREQUENCY.allowed
            raise SceneError(problem, key="frequency", value=frequency, allowed=allowed)
        self.frequency = carrier if frequency is None else float(plain(frequency))
        middle = self.radar_table.waveform.middle_ghz * 1e9 if self.radar_table else self.frequency
        self.material_frequency = middle if frequency is None else self.frequency
        self.materials = materials_of({} if materials is None else materials)
        self.atmosphere = atmosphere_of(atmosphere, path)
        self.attenuation = attenuation_of(self.atmosphere, self.material_frequency, self.radar_table, path)
        self.interferers = interferers_of(interferers, self.folder, path)
        self._data: dict[str, Any] | None = None
        self._tables: Sequence[BodyTable] = ()
        # What `geometry_of` derives from the bodies at time 0, by class; shared by scenes with the same bodies.
        self._derived: dict[Any, Any] = {}
        # Cache of the static bodies' geometry, shared by this scene at all times.
        self._static: dict[Any, Any] = {}
        try:
            self._prepare()
        except SceneError as e:
            raise e.at(file=path) from None

    @classmethod
    def load(cls, path: str | Path) -> Scene:
        """Return the scene of a TOML file, or one that comes with raychan by its name, such as 'urban'.

        Raises: SceneError where file, syntax, key or value is wrong.
        """
        return cls.from_text(*scene_text(path))

    @classmethod
    def from_text(cls, text: str, path: str | Path | None = None) -> Scene:
        """Return the scene of TOML text; `path` is where it came from."""
        return cls._of(overrides.parsed(text, path), path, text)

    @classmethod
    def from_dict(cls, data: Mapping[str, object], path: str | Path | None = None, text: str = "") -> Scene:
        """Return the scene of tables as they stand in a scene file."""
        return cls._of(deepcopy(data), path, text)

    @classmethod
    def _of(cls, data: Mapping[str, object], path: str | Path | None, text: str, like: Scene | None = None) -> Scene:
        """Return the scene of tables; bodies equal to those of the scene `like` are shared, with their meshes."""
        file = None if path is None else Path(path)
        refuse_ship(data, file)
        tables: SceneFile = checked(SceneFile, data, file)
        folder = Path.cwd() if file is None else file.parent
        ghz = tables.scene.frequency_ghz
        known = {t.name: (t, b) for t, b in zip(like._tables, like._given, strict=True)} if like else {}
        scene = cls(
            bodies=[body_of(b, folder, known.get(b.name)) for b in tables.bodies],
            frequency=None if ghz is None else ghz * 1e9,
            radar=tables.radar,
            processing=tables.processing.model_dump(),
            model=tables.model,
            materials={name: material_of(name, m, file) for name, m in tables.materials.items()},
            title=tables.scene.title,
            text=text,
            path=file,
            folder=folder,
            atmosphere=tables.atmosphere,
            interferers=tables.interferers,
        )
        scene._data, scene._tables = dict(data), tables.bodies
        if like is not None and scene._stands_as(like):
            scene._derived = like._derived
        return scene

    def to_toml(self) -> str:
        """Return the scene as the text of a scene file, with meshes and antennas from files by their whole path.

        Raises: ValueError for what no file can hold: a mesh in memory, an antenna of a class of its own.
        """
        from raychan.world.scene_files.scene_text import toml_of

        return toml_of(self)

    def override(self, changes: Sequence[str]) -> Scene:
        """Return the scene with keys changed: 'radar.power_dbm=10', 'bodies.suv.position=[12, 0, 0]'.

        Raises: SceneError for one text, not a list, or a change of no key or body; ValueError for a scene of no file.
        """
        changes = overrides.listed(changes)
        if not changes:
            return self
        if self._data is None:
            raise ValueError("only a scene from a file or from tables has keys to change")
        text = self.text + "".join(f"\n# changed: {c}" for c in changes)
        return self._of(overrides.changed(self._data, changes, self.path), self.path, text, self)

    def __getstate__(self) -> dict[str, Any]:
        # Without caches: a copy, perhaps in another process, makes its own.
        return self.__dict__ | {"_derived": {}, "_static": {}}

    def _stands_as(self, other: Scene) -> bool:
        """Return whether both scenes have the same bodies at the same places, of the same materials."""
        alike = len(self.bodies) == len(other.bodies) and all(map(is_, self.bodies, other.bodies))
        mine, others = ((x.materials, x.material_frequency, x.attenuation) for x in (self, other))
        return alike and mine == others

    def _prepare(self) -> None:
        """Check everything once: a scene that exists can be simulated."""
        checks.names_differ(self.bodies)
        for body in self.bodies:
            try:
                materials_chosen(body, self.materials, self.material_frequency)
                _ = body.motion, body.resolved_role, body.fluctuates, body.rcs_table
            except SceneError as e:
                raise e.at(key="bodies") from None
        self.__dict__["bodies"] = over_seams(self.bodies)
        checks.radar_outside(self.bodies, self.radar_table)
        check_places(self.interferers, self.bodies, self.radar_table)
        if self.radar_table is not None:
            checks.radar_fits(self.radar, self.model.diffraction)

    @cached_property
    def radar(self) -> Radar:
        """The radar at time 0; SceneError where the scene has none."""
        if self.radar_table is None:
            raise SceneError("the scene has no radar", file=self.path, key="radar", allowed="a [radar] table")
        return radar_of(self.radar_table, self.processing, self.folder, self.path)

    def at(self, time: float) -> Scene:
        """Return the scene as it stands at a time [s]: bodies and radar moved on, meshes and materials shared.

        Raises: SceneError for another type, or where by then the radar would be inside a body, or a body or the radar
        beyond the places that a scene may have.
        """
        time = check_time(time)
        if time == 0.0:
            return self
        moved = copy(self)
        then = moved.__dict__
        then["bodies"] = tuple(b.at(time) for b in self.bodies)
        moved._derived = self._derived if moved._stands_as(self) else {}
        moved._static = self._static
        if self.radar_table is not None:
            then["radar"] = radar = self.radar_at(time)
            then["radar_table"] = table_at(self.radar_table, radar)
        then["interferers"] = tuple(x.at(time) for x in self.interferers)
        then.pop("warnings", None)
        then["text"], then["_data"] = f"{self.text}\n{overrides.LATER}{time!r}" if self.text else "", None
        check_later(moved.bodies, moved.radar_table, moved.interferers, time, self.path)
        return moved

    def without_caches(self) -> Scene:
        """Return a copy without caches, for results that outlive the run."""
        return copy(self)

    def radar_at(self, time: float) -> Radar:
        """Return the radar where its velocity has brought it at a time [s]."""
        return self.radar.at(time)

    @cached_property
    def warnings(self) -> list[str]:
        """Warnings: odd meshes, materials out of range, overlaps, bodies out of view, aliased targets."""
        said = [note for body in self.bodies for note in body.notes()]
        said += idle_keys(self._given, self.materials, self.radar_table)
        used = {m for b in self.bodies for m in b.part_materials() if isinstance(m, str) and m not in self.materials}
        said += [note for name in sorted(used) if (note := validity(name, self.material_frequency))]
        opaque = [all(m.kind != LAYER for m in own) for own in self._own_materials]
        said += overlaps.overlaps(self.bodies, opaque, self._static.setdefault("overlaps", {}))
        if self.radar_table is None:
            return said
        said += checks.edge_on(self.bodies, self.radar_table) + overlaps.unseen(self.bodies, self.radar)
        said += array_checks.distrusted(self.bodies, self.radar) + checks.too_near(self.bodies, self.radar)
        return said + checks.aliases(self.bodies, self.radar)

    @cached_property
    def _own_materials(self) -> list[list[Material]]:
        """For each body the materials of its parts."""
        return self._materials_at(self.material_frequency)

    def _materials_at(self, frequency: float) -> list[list[Material]]:
        """Return for each body the materials of its parts at a frequency [Hz]."""
        return [materials_chosen(body, self.materials, frequency) for body in self.bodies]

    @cached_property
    def _index(self) -> tuple[list[Material], list[str], list[tuple[Any, Any]]]:
        """All materials, all part names, and for each body the material and the part number of its parts."""
        return index_of(self.bodies, self._own_materials)

    @property
    def static_geometry(self) -> StaticGeometry | None:
        """Geometry of the static bodies, shared by all instants; None where it does not pay."""
        if StaticGeometry not in self._static:
            self._static[StaticGeometry] = StaticGeometry.of(self.bodies, self.model.mode == PREVIEW)
        static = self._static[StaticGeometry]
        return static and static.at(self.bodies)

    def facets(self, time: float = 0.0, frequency: float | None = None) -> Facets:
        """Return all triangles in the world at a time [s]; bodies in the scene's order; frequency [Hz] of materials and
        air (default `material_frequency`)."""
        index, loss, at = self._index, self.attenuation, self.material_frequency
        if frequency is not None and frequency != at:
            at, index = frequency, index_of(self.bodies, self._materials_at(frequency))
            loss = attenuation_of(self.atmosphere, at, self.radar_table, self.path)
        found = posed(self.bodies, index, at, time, self.static_geometry)
        return found.replace(attenuation=loss) if loss else found

    @property
    def topology(self) -> list[MeshTopology]:
        """Topology of each body's mesh."""
        return [b.geometry.topology for b in self.bodies]

    @property
    def inner_spheres(self) -> tuple[Floats, Floats, NDArray[np.int32]]:
        """Centres (k, 3) [m], radii (k,) [m] and bodies (k,) of spheres inside bodies at time 0."""
        return spheres_inside(self.bodies, self._own_materials)

    def points(self, time: float = 0.0) -> Points:
        """Return the targets given by their RCS at a time [s]."""
        return points_of(self.bodies, time)
