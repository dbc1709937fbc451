"""What did not change is not drawn again, and what did is never stale."""

import json
import tempfile
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from renderers.scene import Camera, GBuffer, Scene
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.delivery import Finisher, Picture
from renderers.snapshots.request import (
    ClassicWork,
    ImageSpec,
    ScopeWork,
    SnapshotRequest,
)
from renderers.snapshots.result_cache import ResultCache, picture_key, trace_key
from renderers.snapshots.scene_loader import load_scene, load_tools
from renderers.snapshots.team import SerialTeam, Traced
from renderers.snapshots.worker import run_worker
from tests.renderers.snapshots.bare_requests import CAMERA, CLASSIC, bare_request, blade

ASKING: dict[str, Any] = {
    "id": "0" * 32,
    "client": "somebody else",
    "priority": 0,
    "max_seconds": 7.0,
    "deadline_s": 1e5,
    "deliver_after_s": 1e4,
    "progressive": True,
}
"""What a request may say that a picture does not depend on."""


def edited(client: SnapshotClient, scene: Scene, edit: int) -> dict[str, str]:
    """Cut some tissue away, another place for each edit; name the arrays."""
    assert scene.surface is not None
    distance = scene.surface.distance.values.copy()
    values = scene.volume.values.copy()
    distance[:, :, : 5 * edit] = -1.0
    values[:, :, : 5 * edit] = -1000
    blood = np.full(distance.shape, 40 * edit, np.uint8)
    names = {"distance": distance, "blood": blood, "volume": values}
    return {name: client.put(array) for name, array in names.items()}


def changed(
    request: SnapshotRequest, step: tuple[str, int], data: list[dict[str, str]]
) -> SnapshotRequest:
    """Move the eye, edit tissue, or set light, lens, tools, fineness or exposure."""
    what, n = step
    work = request.work
    new: dict[str, Any] = {}
    if what == "edit":
        names = data[n].items()
        work = msgspec.structs.replace(
            work, **{k: v for k, v in names if hasattr(work, k)}
        )
    elif what == "eye":
        eye = request.camera.eye_mm[0], request.camera.eye_mm[1], 18.0 + 0.3 * n
        new["camera"] = msgspec.structs.replace(request.camera, eye_mm=eye)
    elif what == "size":
        new["image"] = ImageSpec(16 + 8 * (n % 2), 16, 4 if n == 2 else 1)
    elif what == "quality":
        new["quality"] = ("preview", "snapshot", "final")[n]
    elif what == "light" and isinstance(work, ScopeWork):
        work = msgspec.structs.replace(work, light_power=1.0 + n, gain=0.5 + n)
    elif what == "light":
        work = msgspec.structs.replace(work, background=(0.2 * n, 0.0, 0.0))
    elif what == "tool":
        work = msgspec.structs.replace(work, instruments=work.instruments[:n])
    elif what == "asking":
        new = {"client": "abc"[n], "priority": n, "progressive": bool(n)}
    return msgspec.structs.replace(request, work=work, **new)


STEPS = st.lists(
    st.tuples(
        st.sampled_from(["edit", "eye", "size", "quality", "light", "tool", "asking"]),
        st.integers(0, 2),
    ),
    min_size=1,
    max_size=5,
)


@settings(max_examples=6, deadline=None)
@given(STEPS, st.booleans())
def test_no_sequence_of_edits_and_poses_shows_a_stale_picture(
    scene: Scene, inside: Camera, outside: Camera, steps: Any, classic: bool
) -> None:
    """Each picture of a session has the bits of a renderer that never drew before."""
    assert scene.surface is not None
    with tempfile.TemporaryDirectory() as name:
        client = SnapshotClient(Path(name))
        data = [edited(client, scene, n) for n in range(3)]
        if classic:
            camera = outside.with_size(16, 16)
            first = client.request_classic(scene, camera, instruments=[blade(camera)])
        else:
            tool = [blade(inside)]
            camera = inside.with_size(16, 16)
            first = client.request_scope(
                scene.surface, camera, samples=1, instruments=tool
            )
        requests = [first]
        for step in steps:
            requests.append(changed(requests[-1], step, data))
        # and once more all of them, when everything may be kept
        requests += requests
        jobs = []
        for number, request in enumerate(requests):
            own = msgspec.structs.replace(request, id=f"{number:032x}", priority=5)
            jobs.append(client.submit(own))
        assert run_worker(client.spool.folder, once=True) == len(jobs)
        fresh: dict[bytes, Picture] = {}
        drawn = traced = 0
        for job, request in zip(jobs, requests, strict=True):
            found = client.wait(job)
            drawn += 1 - found.result.counters["views_skipped"]
            traced += 1 - found.result.counters["traces_skipped"]
            key = picture_key(request)
            if key not in fresh:
                fresh[key] = drawn_afresh(client, request)
            assert_array_equal(found.pixels(), fresh[key].pixels)
            assert_array_equal(found.radiance(), fresh[key].radiance)
            assert_array_equal(found.depth_mm(), fresh[key].depth_mm)
        assert drawn == len(fresh)
        assert traced == len({trace_key(request) for request in requests})


def drawn_afresh(client: SnapshotClient, request: SnapshotRequest) -> Picture:
    """Draw with a tracer and a light that have nothing from before."""
    team, finisher = SerialTeam(1), Finisher(client.data, 1)
    try:
        scene = load_scene(client.data, request)
        tools = load_tools(client.data, request)
        traced = team.trace(request, scene, lambda share: True, tools=tools)
        return finisher.finish(request, scene, traced)
    finally:
        finisher.close()


def test_who_asks_and_when_makes_no_other_view(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    request = client.request_classic(scene, outside)
    for name, value in ASKING.items():
        other = msgspec.structs.replace(request, **{name: value})
        assert picture_key(other) == picture_key(request)
        assert trace_key(other) == trace_key(request)


@pytest.mark.parametrize("work", [ScopeWork, ClassicWork])
def test_every_other_field_makes_another_picture(
    client: SnapshotClient,
    scene: Scene,
    inside: Camera,
    work: type[ScopeWork | ClassicWork],
) -> None:
    """Also those that are added later: they count unless they are named here."""
    assert scene.surface is not None
    if work is ScopeWork:
        request = client.request_scope(scene.surface, inside)
    else:
        request = client.request_classic(scene, inside)
    fields = set(SnapshotRequest.__struct_fields__) - set(ASKING) - {"schema"}
    marked = json.loads(picture_key(request))
    assert fields <= set(marked)
    assert set(work.__struct_encode_fields__) <= set(marked["work"])
    for name in fields:
        assert marked[name] == json.loads(msgspec.json.encode(request))[name]


def test_rays_of_mode_classic_end_at_tools(
    client: SnapshotClient, scene: Scene, outside: Camera, inside: Camera
) -> None:
    """And those of mode scope do not, so that what they found is kept."""
    assert scene.surface is not None
    bare = client.request_classic(scene, outside)
    armed = client.request_classic(scene, outside, instruments=[blade(outside)])
    assert trace_key(bare) != trace_key(armed)
    keys = {
        trace_key(client.request_scope(scene.surface, inside, instruments=tools))
        for tools in ([], [blade(inside)])
    }
    assert len(keys) == 1


def test_what_was_stopped_early_is_not_kept() -> None:
    def picture(*, complete: bool) -> Picture:
        plane = np.zeros((8, 8), np.float32)
        pixels = np.zeros((8, 8, 3), np.uint8)
        rgb = np.zeros((8, 8, 3), np.float32)
        counts = np.ones((8, 8), np.uint32)
        return Picture(pixels, rgb, plane, plane, counts, None, complete)

    kept = ResultCache(room=3 * 8 * 8 * (3 + 12 + 4 + 4 + 4))
    requests = [asked(number) for number in range(5)]
    kept.keep_picture(requests[0], picture(complete=False))
    assert kept.picture(requests[0]) is None
    for request in requests[:3]:
        kept.keep_picture(request, picture(complete=True))
    assert kept.picture(requests[0]) is not None
    # the least recently used makes room
    kept.keep_picture(requests[3], picture(complete=True))
    held = [kept.picture(request) is not None for request in requests]
    assert held == [True, False, True, True, False]
    traced = Traced(GBuffer.empty(8, 8), {}, np.zeros((8, 8), np.bool_))
    kept.keep_traced(requests[0], traced)
    assert kept.traced(requests[0]) is None


def asked(number: int) -> SnapshotRequest:
    """Ask for a view; the eye stands elsewhere for each number."""
    eye = float(number), 0.0, 0.0
    camera = msgspec.structs.replace(CAMERA, eye_mm=eye)
    return bare_request(0, camera=camera, work=CLASSIC)
