"""`paravol doctor`: print what this machine, or an arm, can do and what is missing."""

import os
from dataclasses import asdict
from importlib import metadata

from app.cli.root import Json
from app.cli.terminal import ProgressReporter, print_json, print_table
from app.opengl import OpenGL, display_name, probe_offscreen, probe_window
from paravol.checks.finding import Finding
from system import UserError, usable_cores

LOOK_S = 15.0
"""Encoders and clocks are judged by five seconds and more."""


def doctor(
    *, device: str | None = None, accept_constants: bool = False, json: Json = False
) -> int:
    """Say what this machine can do and what is missing, or whether an arm is well.

    Parameters
    ----------
    device
        Look at the MicroScribe on this serial port instead, such as /dev/ttyUSB0 or
        a name under /dev/serial/by-id, while its joints are moved: constants, rate,
        encoders, line, clock, pedals.
    accept_constants
        Keep the arm's constants though they changed or are unusual.
    """
    if device is not None:
        return run_arm_check(device, as_json=json, accept_constants=accept_constants)
    if accept_constants:
        raise UserError("--accept-constants needs --device with the arm's port.")
    return print_findings("This machine", examine(), as_json=json)


def run_arm_check(
    device: str,
    *,
    as_json: bool,
    look_s: float = LOOK_S,
    accept_constants: bool = False,
) -> int:
    """Look at the arm on a port while it is moved; 1 when it is not fit to fly with.

    ``accept_constants`` keeps the arm's constants though they changed. Raise
    DeviceError when there is none, TimeoutError when it falls silent.
    """
    from devices.microscribe import MicroScribe
    from paravol.checks.arm_check import adapter_findings, check_arm
    from paravol.checks.known_constants import constants_findings

    with ProgressReporter() as guide, MicroScribe(device) as arm:
        findings = constants_findings(arm.description, device, accept=accept_constants)
        findings += check_arm(arm, guide, look_s) + adapter_findings(device)
    return print_findings(f"The arm on {device}", findings, as_json=as_json)


def print_findings(title: str, findings: list[Finding], *, as_json: bool) -> int:
    """Print findings as a table or as JSON; 1 when something required is missing."""
    missing = [f.name for f in findings if f.is_missing]
    if as_json:
        print_json({"findings": [asdict(f) for f in findings], "missing": missing})
    else:
        print_table(title, [(f.name, _described(f)) for f in findings])
        if missing:
            print(f"Required and missing: {', '.join(missing)}.")
        else:
            print("Nothing required is missing.")
    return 1 if missing else 0


def examine() -> list[Finding]:
    """Look at everything; takes a few seconds, most of them for OpenGL."""
    from paravol.checks.device_check import device_findings
    from paravol.checks.machine_check import machine_findings, program_findings

    offscreen, window = probe_offscreen(), probe_window()
    return [
        *machine_findings(),
        _opengl("OpenGL off screen", offscreen, "it draws overviews into files"),
        Finding("display", display_name() or "none", why="the window opens on it"),
        _opengl(
            "window",
            window,
            "it draws the overview beside the scope's picture",
            SOFTWARE,
        ),
        _qt(),
        *program_findings(),
        *device_findings(),
        *_choices(offscreen, window),
    ]


def _described(finding: Finding) -> str:
    mark = "MISSING: " if finding.is_missing else ""
    why = f"\n  why: {finding.why}" if finding.why else ""
    remedy = f"\n  do: {finding.remedy}" if finding.remedy else ""
    return f"{mark}{finding.value}{why}{remedy}"


SOFTWARE = (
    "It works, drawn by the processor, which then has less time for the scope's "
    "picture. With a graphics card in the machine, its driver is not in use: on "
    "Debian, apt install libgl1-mesa-dri, or the maker's driver, and log in again."
)


def _opengl(name: str, opengl: OpenGL, why: str, remedy: str = "") -> Finding:
    """Report a trial; remedy: where it is drawn in software."""
    if not opengl.works:
        return Finding(name, "not available", remedy=opengl.problem, why=why)
    told = f"{opengl.vendor}, {opengl.renderer}, {opengl.version}"
    if not opengl.is_software:
        return Finding(name, f"{told}; by the graphics card", why=why)
    return Finding(name, f"{told}; in software", remedy=remedy, why=why)


def _qt() -> Finding:
    why = "it opens the window and hears keys and mouse"
    try:
        version = metadata.version("PySide6-Essentials")
    except metadata.PackageNotFoundError:
        remedy = (
            "pip install 'paravol-ess[desktop]' brings it; paravol demo runs without."
        )
        return Finding("Qt", "not installed", remedy=remedy, why=why)
    platform = os.environ.get("QT_QPA_PLATFORM", "")
    chosen = f"QT_QPA_PLATFORM={platform}" if platform else "platform by the display"
    remedy = ""
    if platform.partition(":")[0] in ("offscreen", "minimal", "vnc"):
        remedy = f"With {chosen} no window appears on the screen; unset it to see one."
    elif not platform and os.environ.get("WAYLAND_DISPLAY"):
        remedy = "Should the window misbehave on Wayland, set QT_QPA_PLATFORM=xcb."
    return Finding("Qt", f"{version}, {chosen}", remedy=remedy, why=why)


def _choices(offscreen: OpenGL, window: OpenGL) -> list[Finding]:
    threads = usable_cores()
    if window.works:
        how = "in software" if window.is_software else "on the graphics card"
        overview = f"Qt window, its overview by OpenGL {how}"
    else:
        overview = "cannot open; `paravol demo` runs without"
    gpu = offscreen.works and not offscreen.is_software
    return [
        Finding("paravol train", overview),
        Finding("endoscope picture", f"CPU rasterizer, {threads} threads"),
        Finding("graphics card", offscreen.renderer if gpu else "none found"),
    ]
