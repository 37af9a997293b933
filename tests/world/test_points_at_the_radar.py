"""A radar at a point target is an error that names the body; there is no direction, and no distance, between them."""

from __future__ import annotations

import pytest
from support.scene_texts import BALL, BARE_RADAR, but_compiling, walker

from raychan import Scene, SceneError
from raychan.cli import invoke

RADAR = BARE_RADAR.replace("[radar]\n", "[radar]\nposition = [0.0, 0.0, 0.5]\n{more}\n", 1)
INTERFERER = '[[interferers]]\nname = "i"\nposition = [5, 0, 0.6]\nwaveform = { bandwidth_mhz = 700, chirp_us = 22 }\n'


def text(x, more="", moves="", rest=""):
    # The point is beside the body: the radar is not in it.
    person = walker(x, 3.0) + "rcs_point = [0.0, -3.0, 0.4]\n" + moves
    return RADAR.format(more=more) + person + BALL + rest


@pytest.mark.parametrize("x", [0.0, 1e-30, 0.009])
def test_a_point_at_the_radar_is_refused_by_its_name(x):
    with pytest.raises(SceneError, match=r"radar\.position: radar is at the point target of 'walker'.*0\.01 m"):
        Scene.from_dict(tables(text(x)))
    Scene.from_dict(tables(text(0.011)))


def tables(toml):
    import tomllib

    return tomllib.loads(toml)


def test_a_point_at_a_receiver_elsewhere_or_an_interferer_is_refused_too():
    with pytest.raises(SceneError, match=r"radar\.rx_position: receiver is at the point target of 'walker'"):
        Scene.from_dict(tables(text(5.0, "rx_position = [5.0, 0.0, 0.5]")))
    with pytest.raises(SceneError, match=r"interferers\.i\.position: interferer 'i' is at the point target"):
        Scene.from_dict(tables(text(5.0, rest=INTERFERER.replace("0.6", "0.5"))))
    Scene.from_dict(tables(text(5.0, rest=INTERFERER)))


def test_a_point_that_passes_through_the_radar_is_refused_at_that_time():
    scene = Scene.from_dict(tables(text(5.0, moves="velocity_mps = [-10.0, 0.0, 0.0]\n")))
    scene.at(0.4)
    with pytest.raises(SceneError, match=r"at the point target of 'walker' 0\.5 s on"):
        scene.at(0.5)


def test_commands_refuse_it_and_a_sweep_keeps_the_steps_before(tmp_path, capsys):
    scene, out = tmp_path / "a.toml", tmp_path / "out"
    scene.write_text(text(0.0))
    for command in (["info", str(scene)], ["run", str(scene), "--out", str(out)]):
        assert invoke(command) == 2
        said = but_compiling(capsys.readouterr().err)
        assert "radar is at the point target of 'walker'" in said and said.count("\n") == 1
    vary = ["--vary", "bodies.walker.position.x=6:-6:5"]
    assert invoke(["study", "sweep", str(scene), "--target", "walker", "--out", str(out), *vary]) == 2
    said = capsys.readouterr().err
    assert "radar is at the point target" in said
    scene.write_text(text(6.0))
    assert invoke(["study", "sweep", str(scene), "--target", "walker", "--out", str(out), *vary]) == 2
    warned, told = but_compiling(capsys.readouterr().err).splitlines()
    assert warned == f"warning: 2 of 5 steps are in {out / 'sweep.csv'}"
    assert "'walker' (step bodies.walker.position.x = 0)" in told


def test_a_sweep_keeps_its_steps_whatever_ends_it_and_names_the_step(tmp_path, monkeypatch, capsys):
    import raychan.study.sweep as study

    scene, out = tmp_path / "a.toml", tmp_path / "out"
    scene.write_text(text(6.0))
    real, calls = study.simulate, []
    argv = ["study", "sweep", str(scene), "--target", "walker", "--times", "0:0.2:3", "--out", str(out)]
    ends = {
        SceneError("no place"): "raychan: no place (step time = 0.1)",
        MemoryError(): "raychan: out of memory; ask for a coarser --tolerance or fewer --max-bounces",
    }
    for error, expected in ends.items():
        calls.clear()

        def ended(*given, error=error, **named):
            calls.append(given)
            if len(calls) == 2:
                raise error
            return real(*given, **named)

        monkeypatch.setattr(study, "simulate", ended)
        assert invoke(argv) == 2
        warned, told = but_compiling(capsys.readouterr().err).splitlines()
        assert (warned, told) == (f"warning: 1 of 3 steps is in {out / 'sweep.csv'}", expected)
