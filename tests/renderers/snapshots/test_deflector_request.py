"""Tissue moved by request: the same picture from whoever draws it."""

from pathlib import Path
from typing import Any

import msgspec
import pytest
from numpy.testing import assert_array_equal

from renderers.art import ActiveRayTracer, Quality
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.art.ranks.ray_travel import make_frame_node
from renderers.scene import Camera, Scene
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.deflector_request import (
    CutSpec,
    DeflectorSpec,
    RotationSpec,
    ScalingSpec,
    TranslationSpec,
    to_deflection,
)
from renderers.snapshots.request import decode_request
from renderers.snapshots.worker import run_worker
from tests.renderers.snapshots.threaded_end import threaded_team


def specs(scene: Scene) -> tuple[DeflectorSpec, ...]:
    x, y, z = (float(v) for v in scene.volume.center_mm)
    return (
        RotationSpec((x, y, z), 6.0, (1.0, 0.0, 0.5), 40.0),
        TranslationSpec((x + 2, y, z), 5.0, (1.0, 1.0, 0.0)),
        ScalingSpec((x, y + 2, z), 4.0, 1.5),
        CutSpec((x + 1, y, z), 5.0, (1.0, 0.0, 0.0), 0.7),
    )


@pytest.mark.parametrize(
    "policy", [Dataflow.REPLICATED, Dataflow.STATIC, Dataflow.MIGRATING]
)
def test_ranks_draw_what_one_tracer_draws(
    tmp_path: Path, scene: Scene, outside: Camera, inside: Camera, policy: Dataflow
) -> None:
    client = SnapshotClient(tmp_path / "spool")
    moved = specs(scene)
    assert scene.surface is not None
    classic = client.request_classic(scene, outside)
    scope = client.request_scope(scene.surface, inside.with_size(48, 40), samples=1)
    requests = [
        msgspec.structs.replace(each, deflectors=moved) for each in (classic, scope)
    ]
    for request in requests:
        client.submit(request)
    with threaded_team(client.data, CellPolicy(None, policy)) as team:
        assert run_worker(client.spool.folder, once=True, team=team)
    tracer = ActiveRayTracer(scene, deflection=to_deflection(moved))
    drawn = client.wait(requests[0].id)
    assert drawn.result.counters["deflected"] > 0
    assert_array_equal(drawn.radiance(), tracer.render(outside).rgba)
    found = tracer.gbuffer(inside.with_size(48, 40))
    assert_array_equal(client.wait(requests[1].id).depth_mm(), found.depth_mm)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"kind": "melt"}, r"deflectors\[0\].kind cannot be 'melt'"),
        ({"radius_mm": -1}, r"\[0\].radius_mm must be a number, more than 0, got -1"),
        ({"strength": 3}, "'strength' is not known in deflectors"),
        ({"shift_mm": [9, 0, 0]}, "deflectors: .* would fold tissue within 5 mm"),
    ],
)
def test_what_is_wrong_is_refused_by_name(
    tmp_path: Path,
    scene: Scene,
    outside: Camera,
    change: dict[str, Any],
    complaint: str,
) -> None:
    client = SnapshotClient(tmp_path / "spool")
    request = msgspec.to_builtins(client.request_classic(scene, outside))
    wrong = msgspec.to_builtins(specs(scene)[1]) | change
    record = msgspec.json.encode(request | {"deflectors": [wrong]})
    with pytest.raises(ValueError, match=complaint):
        decode_request(record)


def test_a_fold_is_told_to_the_client(
    tmp_path: Path, scene: Scene, outside: Camera
) -> None:
    client = SnapshotClient(tmp_path / "spool")
    folding = (ScalingSpec((0.0, 0.0, 0.0), 5.0, 30.0),)
    request = msgspec.structs.replace(
        client.request_classic(scene, outside), deflectors=folding
    )
    with pytest.raises(ValueError, match="scaling by 30 would fold the tissue"):
        client.submit(request)


def test_bent_rays_do_not_travel(scene: Scene) -> None:
    policy = CellPolicy(None, Dataflow.RAYS)
    bent = to_deflection(specs(scene))
    with pytest.raises(ValueError, match="do not travel between ranks; start"):
        make_frame_node(
            scene, "classic", Quality.named("preview"), policy, deflection=bent
        )
