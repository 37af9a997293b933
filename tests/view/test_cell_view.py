"""The rays behind one cell of a map: those of its chains, there and nowhere else, drawn alone."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from support.results import paths, result
from support.scene_texts import ISOTROPIC, upright, walker

from raychan.cli import invoke
from raychan.records import POINT, REFLECT, SCATTER
from raychan.run.explain import explain
from raychan.run.storage import load_result
from raychan.units import dbm
from raychan.view.drawing import Drawing, draw, rays_in
from raychan.view.scene import drawing_of
from raychan.view.web import page
from raychan.world.scene import Scene

GROUND, SUV, TRUCK, WALKER = range(4)
TAIL = [(SUV, SCATTER)]
GHOST = [(TRUCK, REFLECT), (WALKER, POINT), (TRUCK, REFLECT)]

SCENE = f"""{ISOTROPIC}{upright("house", 13.5, 0.5)}{walker(10.0, 1.0)}
[[bodies]]
name = "post"
shape = "box"
params = {{ length = 0.1, width = 0.1, height = 2.0 }}
position = [5.0, -3.0, 0.0]
"""


WORLD = Scene.from_text(SCENE)


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ghost")
    (folder / "ghost.toml").write_text(SCENE)
    out = folder / "out"
    assert invoke(["run", str(folder / "ghost.toml"), "--out", str(out), "--no-pictures"]) == 0
    return out


def test_only_the_paths_in_the_cell_are_drawn_even_where_their_chain_is_stronger_elsewhere():
    p = paths([9.0, 12.0, 9.0], [0.0, 0.0, 0.0], [1e-5, 9e-5, 2e-5], [TAIL, TAIL, GHOST])
    r = result(p, [(9.0, 0.0, 5e-10), (12.0, 0.0, 81e-10)])
    cell = explain(r, 9.0)
    weak, strong = rays_in(r, cell)
    assert (weak.name, strong.name) == ("suv.tail", "truck.tail > walker > truck.tail")
    assert [len(weak.points), len(strong.points)] == [3, 5]
    assert weak.points[1][0] == pytest.approx(9.0)
    assert weak.power == pytest.approx(dbm(cell.predicted * cell.contributions[1].share))
    assert {ray.label for ray in (weak, strong)} == {"multipath"}


def test_a_cell_of_noise_has_no_rays():
    r = result(paths([9.0], [0.0], [1e-5], [TAIL]), [(9.0, 0.0, 1e-10), (15.0, 0.0, 1e-8)])
    assert rays_in(r, explain(r, 15.0)) == ()


def test_bodies_without_a_part_in_the_cell_are_seen_through(ran, tmp_path):
    r = load_result(ran)
    cell = explain(r, np.hypot(17.0, 1.0))
    drawing = drawing_of(r.scene, r, cell)
    opacity = {s.name: s.opacity for s in drawing.shapes}
    assert opacity["house"] == opacity["walker"] == 1.0
    assert opacity["post"] < 0.5
    assert [ray.name for ray in drawing.rays] == ["house > walker > house"]
    assert "3 interactions, 17.0" in drawing.caption and "multipath" in drawing.title
    drawing.save(tmp_path / "d.npz")
    assert Drawing.load(tmp_path / "d.npz").caption == drawing.caption
    whole = draw("", r.scene.facets(), r.scene.points(), r.scene.radar.position, r.scene.radar.boresight, r)
    assert {s.opacity for s in whole.shapes} == {1.0} and len(whole.rays) > 2 and not whole.caption


def test_explain_prints_the_chain_with_interactions_and_view_draws_it(ran, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("RAYCHAN_NO_OPENGL", "1")
    image = np.hypot(17.0, 1.0)
    capsys.readouterr()
    assert invoke(["explain", str(ran), "--range", f"{image:.2f}", "--speed", "0"]) == 0
    assert "radar > house > walker > house > radar, 3 interactions, 17.0" in capsys.readouterr().out
    picture, page = tmp_path / "ghost.png", tmp_path / "ghost.html"
    command = ["view", str(ran), "--range", f"{image:.2f}", "--screenshot", str(picture), "--html", str(page)]
    assert invoke(command) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    rays = json.loads(re.search(r'"rays": (\[.*?\]), "targets"', page.read_text())[1])
    assert [ray["name"] for ray in rays] == ["house > walker > house"]
    points = np.frombuffer(base64.b64decode(rays[0]["points"]), "<f4").reshape(-1, 3)
    # The image of the walker stands at (17, 1, 1); the ray meets the mirror on the straight line to it.
    assert points[1] == pytest.approx([13.5, 13.5 / 17.0, 1.0], abs=1e-3)
    assert points[2] == pytest.approx([10.0, 1.0, 1.0], abs=1e-3)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["{out}", "--range", "900"], "outside the map"),
        (["{out}", "--speed", "1"], "it needs --range"),
        (["{scene}", "--range", "9"], "is a scene"),
    ],
)
def test_a_cell_that_cannot_be_shown_is_told(options, words, ran, tmp_path, capsys):
    names = {"out": ran, "scene": ran.parent / "ghost.toml"}
    picture = tmp_path / "x.png"
    assert invoke(["view", *(o.format(**names) for o in options), "--screenshot", str(picture)]) == 2
    assert words in capsys.readouterr().err
    assert not picture.exists()


def test_a_cell_of_noise_is_shown_without_rays_and_with_a_warning(ran, tmp_path, capsys):
    page = tmp_path / "noise.html"
    assert invoke(["view", str(ran), "--range", "30", "--html", str(page)]) == 0
    assert "no path explains this cell" in capsys.readouterr().err
    assert '"rays": []' in page.read_text()


def test_rays_of_a_detection_that_is_not_converged_are_dashed_and_the_others_whole(tmp_path):
    p = paths([9.0, 12.0], [0.0, 0.0], [1e-5, 9e-6], [TAIL, GHOST])
    r = result(p, [(9.0, 0.0, 1e-10), (12.0, 0.0, 81e-12)])
    doubted = replace(r.provenance[1], error_db=float("nan"))
    drawing = drawing_of(WORLD, replace(r, provenance=(r.provenance[0], doubted)))
    whole, broken = sorted(drawing.rays, key=lambda ray: not ray.converged)
    assert len(whole.strokes(0.5)) == 1
    made = broken.strokes(0.5)
    length = np.linalg.norm(np.diff(broken.points, axis=0), axis=1).sum()
    drawn = sum(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in made)
    assert drawn == pytest.approx(0.5 * length, abs=0.51)
    assert "dashed" in drawing.note and "not converged" in broken.text
    drawing.save(tmp_path / "d.npz")
    assert [ray.converged for ray in Drawing.load(tmp_path / "d.npz").rays] == [ray.converged for ray in drawing.rays]
    text = page(drawing).decode()
    assert "not converged" in text and drawing.note in text
    assert drawing_of(WORLD, r).note == ""


def test_view_takes_the_number_of_a_detection(ran, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("RAYCHAN_NO_OPENGL", "1")
    assert invoke(["view", str(ran), "--detection", "1", "--html", str(tmp_path / "a.html")]) == 0
    place = load_result(ran).detections.range[0]
    assert f"{place:.2f} m" in (tmp_path / "a.html").read_text()
    capsys.readouterr()
    assert invoke(["view", str(ran), "--detection", "999", "--html", str(tmp_path / "b.html")]) == 2
    assert "no detection has the number 999" in capsys.readouterr().err
    assert invoke(["view", str(ran), "--detection", "1", "--range", "9", "--html", str(tmp_path / "b.html")]) == 2
    assert not (tmp_path / "b.html").exists()
