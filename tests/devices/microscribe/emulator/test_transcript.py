import io

from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.faults.catalogue import parse_fault
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.emulator.transcript import Transcript
from devices.microscribe.kinematics.profiles import DX40937


def test_it_tells_time_direction_state_bytes_and_meaning() -> None:
    log = io.StringIO()
    arm = EmulatedArm(
        DX40937,
        StillMotion(DX40937),
        faults=[parse_fault("f8_dropped_byte=0@packet:2")],
        now_s=100.0,
        transcript=Transcript(log),
    )
    for i, data in enumerate((b"\xc5IMMC", b"BEGIN", b"\xcb\x03", b"\x03", b"\xc7x\0")):
        arm.hear(data, 101.0 + i)
        arm.speak(101.5 + i)
    arm.unplug(110.0)
    rows = [line.split("\t") for line in log.getvalue().splitlines()]
    assert all(len(row) == 5 for row in rows)
    assert [(row[1], row[2]) for row in rows] == [
        ("!", "-"),
        (">", "SYNC"),
        ("<", "WAIT_BEGIN"),
        (">", "WAIT_BEGIN"),
        ("<", "IDLE"),
        (">", "IDLE"),
        ("<", "IDLE"),
        ("<", "IDLE"),
        (">", "IDLE"),
        ("<", "IDLE"),
        (">", "IDLE"),
        ("!", "-"),
        ("<", "IDLE"),
        ("<", "IDLE"),
        ("!", "-"),
    ]
    assert float(rows[1][0]) == 1.0
    assert rows[1][3] == "C5 49 4D 4D 43"
    assert rows[6][4] == "string 'EMU00001'"
    assert rows[7][4].endswith("counts [13903, 6238, 6868, 4098, 3193, 8416]")
    assert rows[9][3].startswith("83 00")
    assert "spoilt: 00 6C 4F" in rows[9][4]
    assert "calibration memory was asked for" in rows[11][4]
    assert rows[10][4] == "set parameters (calibration memory)"
    assert [row[4] for row in rows[12:]] == [
        "echo of set parameters (calibration memory)",
        "password",
        "unplugged",
    ]
