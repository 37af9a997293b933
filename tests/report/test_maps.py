"""Pictures of maps: detections stand where the map shows their echoes."""

from __future__ import annotations

import dataclasses
import warnings

import numpy as np
import pytest
from support.results import paths, result

from raychan.records import SCATTER
from raychan.report.canvas import figure
from raychan.report.figures import rdmap_picture

PLACES = [(9.0, 3.0, 1e-9), (12.0, -7.0, 1e-10)]


def _result():
    return result(paths([9.0, 12.0], [3.0, -7.0], [3e-5, 1e-5], [[(1, SCATTER)], [(3, SCATTER)]]), PLACES)


def _drawn(of):
    axes = figure(8.2, 4.6).add_subplot()
    rdmap_picture(of, axes=axes)
    return axes


def test_a_detection_whose_rate_is_unfolded_is_marked_at_its_cell():
    plain = _result()
    span = 2.0 * plain.rdmap.unambiguous_rate
    d = plain.detections
    unfolded = dataclasses.replace(plain, detections=d.replace(rate=d.rate - [0.0, span]))
    axes = _drawn(unfolded)
    (low, high), rows = axes.get_ylim(), d.cell[:, 0]
    marks = [line.get_ydata() for line in axes.lines if line.get_marker() == "o"]
    assert marks[0] == pytest.approx([3.0, plain.rdmap.rate[rows[1]]])
    assert ((marks[0] > low) & (marks[0] < high)).all()
    assert "direct (2)" in [t.get_text() for t in axes.get_legend().get_texts()]
    assert any(f"unfolded to {-7.0 - span:.1f} m/s" in t.get_text() for t in axes.texts)


def test_every_detection_has_its_number_also_beside_another_one_of_its_body():
    pair = paths([9.0, 10.5], [3.0, 3.2], [3e-5, 1e-5], [[(1, SCATTER)], [(1, SCATTER)]])
    axes = _drawn(result(pair, [(9.0, 3.0, 1e-9), (10.5, 3.2, 1e-10)]))
    heads = [t.get_text().splitlines()[0].split(":")[0] for t in axes.texts if t.get_text()[:1].isdigit()]
    assert heads == ["1", "2"]
    assert axes.texts[-1].get_text() == "2"


def test_the_map_of_one_chirp_is_drawn_without_a_word():
    whole = _result()
    m, d = whole.rdmap, whole.detections
    one = dataclasses.replace(m, rate=np.zeros(1), spectrum=m.spectrum[:, :1], power=m.power[:1])
    flat = dataclasses.replace(
        whole, rdmap=one, detections=d.replace(rate=np.zeros(2), cell=d.cell * [0, 1], speed=np.zeros(2))
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        axes = _drawn(flat)
    low, high = axes.get_ylim()
    assert low < 0.0 < high
