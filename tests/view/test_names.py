"""Names and titles stand in pictures as they are written, in whatever letters."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from raychan.report.canvas import Placer, drawn_as, figure, legible, verbatim
from raychan.view.drawing import Ray
from raychan.view.render import _tell, _tube


@pytest.mark.parametrize(
    ("name", "drawn"),
    [
        ("Fußgänger Łódź", "Fußgänger Łódź"),
        ("грузовик λ", "грузовик λ"),
        ("LKW日", r"LKW\u65e5"),
        ("\U00020000\n\tx", "\\U00020000\n\\tx"),
        ("caf\udce9", r"caf\udce9"),
    ],
)
def test_letters_stand_as_they_are_and_those_that_the_font_lacks_by_their_numbers(name, drawn):
    assert legible(name) == verbatim(name) == drawn


def test_labels_and_titles_are_no_mathematics_and_warn_of_nothing():
    axes = figure(3.0, 2.0).add_subplot()
    axes.set_title(verbatim("$\\frac$ 日"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        placer = Placer(axes)
        placer.prepare()
        assert placer.label(0.5, 0.5, "a$\\frac$日")
        drawn_as(axes.figure, ".png")


def test_a_click_on_a_ray_tells_its_bodies_in_their_letters(capsys):
    import pyvista

    ray = Ray("Fußgänger > 日", np.eye(3), -90.0, "multipath")
    _tell(_tube(ray, 0.1, pyvista))
    assert capsys.readouterr().out == "Fußgänger > 日: -90.0 dBm multipath\n"
