"""Records, scenes and results tell of themselves in a few lines, in text and in HTML, and draw themselves."""

from __future__ import annotations

import dataclasses
import re
from html.parser import HTMLParser

import matplotlib
import numpy as np
import pytest
from support.results import paths, result
from support.scene_texts import PLATE

import raychan as rc
from raychan.records import REFLECT, SCATTER
from raychan.reprs import Facts

CHAIN = [(2, REFLECT), (3, SCATTER), (2, REFLECT)]


@pytest.fixture
def made():
    p = paths([9.0, 5.0], [-7.0, 1.0], [1e-5 + 2e-5j, 3e-6], [CHAIN, [(1, SCATTER)]])
    return result(p, [(9.0, -7.0, 5e-10), (5.0, 1.0, 9e-12)])


@pytest.fixture(autouse=True)
def without_a_window():
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    yield
    plt.close("all")


class Tags(HTMLParser):
    """Collects texts and holds tags to their pairs."""

    def __init__(self, page):
        super().__init__()
        self.open, self.texts = [], []
        self.feed(page)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        assert tag in ("div", "b", "table", "thead", "tbody", "tr", "th", "td")
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


def every(made):
    return [made, *(getattr(made, f.name) for f in dataclasses.fields(made)), made.paths.trajectories]


def test_a_repr_is_short_and_holds_no_dump_of_an_array(made):
    for thing in (t for t in every(made) if hasattr(t, "facts")):
        text = repr(thing)
        assert text.startswith(type(thing).__name__), text
        assert "array(" not in text and text.count("\n") < 20 and max(map(len, text.splitlines())) < 160
        Tags(thing._repr_html_())


def test_a_result_tells_its_detections_and_what_made_them(made):
    text = repr(made)
    for word in ("9.00", "-7.00", "30.0", "-63.0", "multipath", "truck.tail > walker > truck.tail", "a warning"):
        assert word in text
    assert "truck.tail > walker" in " ".join(Tags(made._repr_html_()).texts)
    assert "2 paths" in repr(made.paths) and "5 to 9 m" in repr(made.paths) and "suv, truck, walker" in repr(made.paths)
    assert "-63.0 dBm at 8.99 m, -6.84 m/s" in repr(made.rdmap) and "noise" in repr(made.rdmap)
    assert repr(made.detections).splitlines()[0] == "ExplainedDetections: 2"


def test_an_empty_result_tells_that_it_is_empty():
    none = result(paths([], [], [], []), [])
    assert "detections  0" in repr(none) and "0 paths" in repr(none.paths)
    for thing in (t for t in every(none) if hasattr(t, "facts")):
        Tags(thing._repr_html_())


def test_names_from_a_scene_cannot_end_the_html_they_stand_in():
    evil = PLATE.replace("A plate ahead", "<script>alert(1)</script>").replace('"sign"', '"<b>&sign"')
    scene = rc.Scene.from_text(evil)
    page = scene._repr_html_()
    assert "<script" not in page and "<b>&sign" in "".join(Tags(page).texts)
    assert "plate" in repr(scene) and "(9, 0, 1) m" in repr(scene) and "77 GHz" in repr(scene)
    assert repr(rc.Scene()).startswith("Scene")


def test_long_tables_are_cut_and_say_so():
    facts = Facts("many", (), ("a",), tuple((str(i),) for i in range(99)))
    assert facts.text().endswith("and 87 more") and facts.text().count("\n") == 14
    assert Tags(facts.html()).texts[-1] == "and 87 more"


def test_a_result_its_map_and_its_profile_draw_themselves_in_given_axes_or_new_ones(made):
    import matplotlib.pyplot as plt

    top, bottom = made.plot()
    assert top.get_xlabel() == bottom.get_xlabel() == "range [m]"
    assert "multipath (1)" in [t.get_text() for t in top.get_legend().get_texts()]
    mine = plt.figure().add_subplot()
    assert made.rdmap.plot(mine) is mine
    (mesh,) = mine.collections
    np.testing.assert_allclose(mesh.get_array().max(), 10 * np.log10(5e-10) + 30)
    line = made.profile.plot().lines[0]
    np.testing.assert_allclose(line.get_xdata(), made.profile.range)
    assert plt.get_fignums() == [1, 2, 3], "figures of pyplot, which a notebook shows"
    with pytest.raises(AttributeError):
        made.paths.plot()
    with pytest.raises(ValueError, match="axes = 3: an Axes of matplotlib is wanted, or None"):
        made.rdmap.plot(3)
    with pytest.raises(ValueError, match=r"axes = .*: two Axes of matplotlib are wanted, or None"):
        made.plot(mine)


def test_the_gain_of_specular_paths_is_that_of_their_strongest_polarisation():
    wave = rc.Waveform(77e9, 500e6, 40e-6, n_chirps=16, n_samples=32)
    ground = rc.Scene(bodies=[rc.Body(name="ground", shape="ground")], radar=rc.Radar(wave))
    paths = rc.specular_paths(ground, tx=(0, 0, 0.5), rx=(20, -3, 1.3), max_bounces=1)
    free = 20.0 * np.log10(299_792_458.0 / wave.carrier / (4.0 * np.pi * paths.length[0]))
    (shown,) = re.findall(r"gain +(\S+) to (\S+) dB", repr(paths))
    assert float(shown[1]) == pytest.approx(free, abs=0.02) and free - 10.0 < float(shown[0]) < free
