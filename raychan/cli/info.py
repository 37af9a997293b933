"""raychan info: contents of a scene, an antenna or a mesh, and the figures of the radar."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from raychan.cli import show
from raychan.cli.info_impairments import impairment_rows
from raychan.cli.rcs_options import writable

if TYPE_CHECKING:
    from rich.table import Table

_WORDS = {
    "tx_gain": "transmit gain",
    "rx_gain": "receive gain",
    "eirp": "EIRP",
    "max_path_loss": "largest one-way loss to one channel, receive gain left out",
    "noise": "noise in a sample (kT0 F fs)",
    "coherent_gain": "gain of chirps x samples, of one channel",
    "sensitivity": "noise in a cell of the map of one channel (rectangular windows)",
    "array_gain": "gain of a beam over all channels",
    "beam_sensitivity": "noise in a cell of a beam's map (rectangular windows)",
}
_OF_ARRAYS = ("array_gain", "beam_sensitivity")
_TOLD = ("vertices", "faces", "size", "watertight")  # of a mesh's report, in other words
_FIGURES = {
    "gain_dbi": "gain [dBi]",
    "hpbw_h_deg": "half-power width, azimuth [deg]",
    "hpbw_v_deg": "half-power width, elevation [deg]",
    "sll_h_db": "highest side lobe, azimuth [dB]",
    "sll_v_db": "highest side lobe, elevation [dB]",
}


def info(
    source: Annotated[
        Path,
        typer.Argument(
            help="Scene file, antenna file, or a mesh (GLB, OBJ, PLY, STL).",
            metavar="SCENE|ANTENNA|MESH",
            show_default=False,
        ),
    ],
    unit: Annotated[
        str | None, typer.Option(help="Unit of a mesh file: m, cm, mm, inch, ft; m if not given.", show_default=False)
    ] = None,
    up: Annotated[
        str | None,
        typer.Option(
            help="Axis of the mesh file that points up; if not given, y for GLB and z for others.", show_default=False
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(help="Draw the scene's probability of detection against SNR to this file.", metavar="FILE.png"),
    ] = None,
) -> None:
    """Show what is in a scene, an antenna or a mesh.

    For a scene: bodies, parts, materials, link budget, SNR and probability of detection of targets given by their RCS,
    resolutions, and the figures of its antennas. For an antenna:
    its figures, computed from its pattern, beside the published ones if its file has them. For a mesh: its size and
    defects."""
    from raychan.world.mesh_files.mesh_io import SUFFIXES, load
    from raychan.world.scene_files.bundled import found

    writable(plot, (".png", ".pdf", ".svg"))
    source = found(source)
    if source.suffix.lower() in SUFFIXES:
        if plot is not None:
            raise typer.BadParameter(f"{source} is no scene file", param_hint="--plot")
        _mesh(load(source, unit=unit or "m", up=up), source, unit or "m", up)
        return
    from raychan.world.scene_files.radar_mount import antenna_of, antenna_table, is_antenna

    if plot is not None and is_antenna(source):
        raise typer.BadParameter(f"{source} is no scene file", param_hint="--plot")
    for option, value in (("--unit", unit), ("--up", up)):
        if value is not None:
            raise typer.BadParameter(f"{source} is not a mesh file ({', '.join(SUFFIXES)})", param_hint=option)
    if is_antenna(source):
        table, _ = antenna_table(source.name, source.parent, "")
        made = antenna_of(source.name, "V", source.parent, "")
        show.console().print(_antenna(str(source), made, table))
        return
    from raychan.world.scene import Scene

    scene = Scene.load(source)
    _scene(scene)
    if plot is not None:
        _drawn(scene, plot)


def _mesh(mesh: Any, source: Path, unit: str, up: str | None) -> None:
    import numpy as np

    from raychan.world.mesh_files.mesh_io import oddities
    from raychan.world.meshes.creases import uncertain_folds

    low, high = mesh.bounds
    areas = np.bincount(mesh.part, mesh.areas, minlength=len(mesh.part_names))
    counts = np.bincount(mesh.part, minlength=len(mesh.part_names))
    r = mesh.report
    size = " x ".join(f"{x:.3f}" for x in high - low)
    facts = [
        ("size, x forward by y left by z up", f"{size} m"),
        ("vertices, facets", f"{len(mesh.vertices)}, {len(mesh.faces)}"),
        ("watertight", "yes" if r.watertight else "no"),
        *((name.replace("_", " "), str(value)) for name, value in vars(r).items() if name not in _TOLD),
    ]
    screen = show.console()
    screen.print(show.table(str(source), ("mesh", ""), facts, left=(0, 1)))
    parts = [(n, str(c), f"{a:.4g}") for n, c, a in zip(mesh.part_names, counts, areas, strict=True)]
    screen.print(show.table("", ("part", "facets", "area m2"), parts))
    folds = uncertain_folds(mesh, "crease_deg (raychan rcs: --crease)")
    show.warn([*r.warnings(), *oddities(mesh, source, unit, up, "--"), *([folds] if folds else [])])


def _scene(scene: Any) -> None:
    screen = show.console()
    screen.print(scene.title, style="bold")
    for made in (_bodies(scene), _parts(scene), *_radar(scene.radar), *_targets(scene), *_antennas(scene)):
        screen.print(made)
    if rows := impairment_rows(scene):
        screen.print(show.table("", ("receiver, air, other radars", ""), rows, left=(0,)))
    show.warn(scene.warnings)


def _bodies(scene: Any) -> Table:
    import numpy as np

    facets, points = scene.facets(0.0), scene.points(0.0)
    place = scene.radar.position
    rows = []
    for b, name in enumerate(facets.body_names):
        corners = facets.vertices[facets.body == b].reshape(-1, 3)
        role = ("scatters", "mirror", "blocks")[facets.role[b]]
        target = np.flatnonzero(points.body == b)
        if len(target):
            low, high = 10.0 * np.log10([points.sigma[target].min(), points.sigma[target].max()])
            role = f"RCS {low:.1f} dBsm" if high - low < 0.05 else f"RCS {low:.1f} to {high:.1f} dBsm"
        size, near = "", ""
        if len(corners) and facets.role[b] != 1:
            size = " x ".join(f"{x:.2f}" for x in np.ptp(corners, axis=0))
            near = f"{np.linalg.norm(corners - place, axis=1).min():.2f}"
        origin = ", ".join(f"{x:.2f}" for x in facets.origin[b])
        speed = ", ".join(f"{x:g}" for x in facets.velocity[b])
        rows.append((name, role, f"{len(corners) // 3}", size, origin, speed, near))
    heads = ("body", "role", "facets", "extent m", "origin m", "velocity m/s", "nearest corner m")
    return show.table("Bodies", heads, rows, left=(0, 1))


def _parts(scene: Any) -> Table:
    """Return a row for each material of each body, with the parts made of it."""
    import numpy as np

    facets = scene.facets(0.0)
    m = facets.materials
    cross = np.cross(facets.vertices[:, 1] - facets.vertices[:, 0], facets.vertices[:, 2] - facets.vertices[:, 0])
    area = 0.5 * np.linalg.norm(cross, axis=1)
    rows = []
    for b, body in enumerate(scene.bodies):
        mine = facets.body == b
        for k in np.unique(facets.material[mine]):
            rows_of = mine & (facets.material == k)
            parts = [facets.part_names[p] or "all" for p in np.unique(facets.part[rows_of])]
            part = body.geometry.part_names.index(parts[0]) if parts[0] != "all" else 0
            material = body.part_materials()[part]
            name = material if isinstance(material, str) else material.name or "own"
            what = "perfect conductor" if m.kind[k] == 0 else f"{m.eps[k].real:.3g} {m.eps[k].imag:+.3g}j"
            layer = f"{1e3 * m.thickness[k]:.3g}" if m.kind[k] == 2 else ""
            size = "" if facets.role[b] == 1 else f"{area[rows_of].sum():.3g}"
            rows.append((body.name, name, what, layer, str(int(rows_of.sum())), size, ", ".join(parts)))
    heads = ("body", "material", "relative permittivity", "layer mm", "facets", "area m2", "parts")
    return show.table("Materials", heads, rows, left=(0, 1, 2, 6))


def _radar(radar: Any) -> list[Table]:
    units = {"dbm": "dBm", "dbi": "dBi", "db": "dB", "m": "m"}
    budget = []
    for key, value in radar.link_budget().items():
        name, unit = key.rsplit("_", 1)
        if name in _OF_ARRAYS and len(radar.virtual_elements) == 1:
            continue
        figure = f"{1e3 * value:.4g} mm" if unit == "m" else f"{value:.2f} {units[unit]}"
        budget.append((_WORDS.get(name, name.replace("_", " ")), figure))
    chirp_rows = _chirp(radar)
    return [
        show.table("Radar", ("link budget", ""), budget, left=(0,)),
        show.table("", ("waveform", ""), chirp_rows, left=(0,)),
    ]


def _targets(scene: Any) -> list[Table]:
    """Return the SNR and the probability of detection of targets given by their RCS."""
    from raychan.run.target_links import target_links

    rows = [
        (
            t.name,
            f"{t.range:.2f}",
            f"{round(t.rcs, 1) + 0.0:.1f}",
            str(t.swerling),
            f"{t.snr:.1f}",
            f"{t.probability:.3f}",
        )
        for t in target_links(scene)
    ]
    heads = ("target", "range m", "RCS dBsm", "Swerling", "SNR in a cell dB", "probability of detection")
    return [show.table("Targets given by their RCS, direct path", heads, rows, left=(0,))] if rows else []


def _drawn(scene: Any, plot: Path) -> None:
    from raychan.report.detection_figure import detection_picture
    from raychan.run.files.output import write_whole
    from raychan.run.target_links import detector_of, target_links

    detector = detector_of(scene.radar)
    if detector is None:
        raise typer.BadParameter("the radar's map is too small for a CFAR", param_hint="--plot")
    write_whole(plot, detection_picture(detector, target_links(scene), scene.title or "Detector", plot.suffix))
    show.console().print(f"written: {plot}", soft_wrap=True)


def _chirp(radar: Any) -> list[tuple[str, str]]:
    w = radar.waveform
    # A map measures range rates at the frequency of the ramp's middle.
    of_middle = w.carrier / w.middle
    times = f"{w.repetition * 1e6:g} us"
    if w.stagger:
        times = f"{', '.join(f'{t * 1e6:g}' for t in w.stagger)} us in turn"
    return [
        ("carrier, bandwidth", f"{w.carrier / 1e9:g} GHz, {w.bandwidth / 1e6:g} MHz"),
        ("chirp sampled, repeated", f"{w.chirp_duration * 1e6:g} us, {times}"),
        ("chirps x samples", f"{w.n_chirps} x {w.n_samples} {'I/Q' if w.complex_sampling else 'real'}"),
        ("sample rate", f"{w.sample_rate / 1e6:.4g} MS/s"),
        ("range resolution (rectangular window)", f"{w.range_resolution:.4g} m"),
        ("range rate resolution (rectangular window)", f"{w.rate_resolution * of_middle:.4g} m/s"),
        ("unambiguous range", f"{w.unambiguous_range:.4g} m"),
        (
            "unambiguous range rate" + (", by the staggered times" if w.stagger else ""),
            f"+-{radar.resolved_rate * of_middle:.4g} m/s",
        ),
    ]


def _antennas(scene: Any) -> list[Table]:
    """Return the figures of the antennas: of one if transmitter and receiver share it, else of each."""
    from raychan.world.scene_files.radar_mount import antenna_table, mounted

    (key, sent), (other, gathered) = mounted(scene.radar_table)
    uses = [("transmit and receive", key, sent, scene.radar.tx)]
    if other != key:
        uses = [("transmit", key, sent, scene.radar.tx), ("receive", other, gathered, scene.radar.rx)]
    made = []
    for use, where, given, antenna in uses:
        table, _ = antenna_table(given, scene.folder, where)
        made.append(_antenna(f"{given if isinstance(given, str) else table.kind}, {use}", antenna, table))
    return made


def _antenna(title: str, antenna: Any, table: Any) -> Table:
    """Return the figures computed from an antenna's pattern, beside the published ones where its table has them."""
    import math

    from raychan.radar.pattern import characteristics

    found, rows = characteristics(antenna), []
    for name, words in _FIGURES.items():
        value = getattr(found, name)
        cells = [words, "none" if math.isnan(value) else f"{round(value, 2) + 0.0:.2f}"]
        if table.published:
            printed = getattr(table.published, name)
            cells.append("" if printed is None else f"{printed:g}")
        rows.append(cells)
    heads = (f"antenna: {title}", "computed", *(["published"] if table.published else []))
    return show.table("", heads, rows)
