"""Moves of the app that come while another one runs."""

import threading
import time

from scenes import stop_scene

import simbrake as sb
from simbrake.pages import _app


def test_the_latest_move_wins(monkeypatch):
    """Three moves while the first runs: it ends early, the second never begins, the
    third is answered."""
    app = _app.App(stop_scene(load=300.0), {}, "")
    begun = threading.Event()
    ran = []
    real = sb.simulate

    def slow(scene, progress, **options):
        ran.append(float(scene.initial.omega))
        progress(2.0, 5.0)
        begun.set()
        while ran[-1] == 1.0 and app._latest < 3:
            time.sleep(0.02)
        progress(3.0, 5.0)
        return real(scene, **options)

    monkeypatch.setattr(_app, "simulate", slow)
    found = {}
    moves = [
        threading.Thread(
            target=lambda w=w: found.update(
                {w: list(app.answers({"initial.omega": w}))}
            )
        )
        for w in (1.0, 2.0, 3.0)
    ]
    moves[0].start()
    begun.wait(10)
    time.sleep(0.5)
    for move in moves[1:]:
        move.start()
        time.sleep(0.1)
    for move in moves:
        move.join(60)
    assert found[1.0][-1] == found[2.0][-1] == {"superseded": True}
    assert found[1.0][0] == {"progress": 0.4}
    assert "results" in found[3.0][-1]
    assert ran == [1.0, 3.0]
