"""`paravol doctor`: it tells what is there, and fails only for what is required."""

import json
import platform

import numpy as np
import pytest

from app.cli import doctor
from app.cli.doctor import examine
from app.opengl import OpenGL
from devices.serial_adapters import SerialAdapter
from paravol.checks import machine_check
from paravol.checks.device_check import serial_ports
from paravol.checks.finding import Finding

OPENGL = OpenGL("Maker", "Some GPU", "4.6")


def test_the_report_names_this_machine(capsys: pytest.CaptureFixture[str]) -> None:
    assert doctor.doctor(json=True) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["missing"] == []
    told = {finding["name"]: finding["value"] for finding in report["findings"]}
    assert platform.python_version() in told["Python"]
    assert told["numpy"] == np.__version__
    assert {
        "processor",
        "memory",
        "compiled kernels",
        "phantoms",
        "OpenGL off screen",
        "display",
        "window",
        "MPI",
        "ffmpeg",
        "serial ports",
        "endoscope picture",
    } <= set(told)
    assert "ersion" in told["ffmpeg"]


def test_serial_ports_are_told_with_what_keeps_an_arm_from_being_well_there() -> None:
    by_id = "/dev/serial/by-id/usb-FTDI_1-port0"
    found = serial_ports(
        [
            SerialAdapter("/dev/ttyUSB0", by_id, 16, True),
            SerialAdapter("/dev/ttyUSB1", "", 1, True),
            SerialAdapter("/dev/ttyS0", "", None, False),
        ]
    )
    assert found.value.splitlines() == [
        f"{by_id} (/dev/ttyUSB0), latency timer 16 ms",
        "/dev/ttyUSB1, latency timer 1 ms",
        "/dev/ttyS0, not yours to open",
    ]
    slow, closed = found.remedy.splitlines()
    assert "ttyUSB0/latency_timer sets it to 1 ms" in slow
    assert closed.startswith("/dev/ttyS0: it belongs to the group ")
    assert not found.is_missing
    assert serial_ports([]).value.startswith("none")


@pytest.mark.parametrize("as_json", [True, False])
def test_something_required_that_is_missing_fails(
    as_json: bool,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    findings = [
        Finding("scipy", "not installed", True, "pip install paravol-ess brings it."),
        Finding("MPI", "no mpiexec", remedy="Snapshots use one rank."),
    ]
    monkeypatch.setattr(doctor, "examine", lambda: findings)
    assert doctor.doctor(json=as_json) == 1
    said = capsys.readouterr().out
    assert "scipy" in said
    if as_json:
        assert json.loads(said)["missing"] == ["scipy"]
    else:
        assert "Required and missing: scipy." in said


def test_an_absent_package_is_required_unless_it_is_an_extra(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    absent = {"numba": "not installed", "mpi4py": "not installed", "vtk": "9.4"}
    monkeypatch.setattr(machine_check, "versions", lambda: absent)
    monkeypatch.setattr(doctor, "probe_offscreen", lambda: OPENGL)
    monkeypatch.setattr(doctor, "probe_window", lambda: OPENGL)
    found = {finding.name: finding for finding in examine()}
    assert [name for name, f in found.items() if f.is_missing] == ["numba"]
    assert "mpi" in found["mpi4py"].remedy
    assert found["vtk"].remedy == ""
