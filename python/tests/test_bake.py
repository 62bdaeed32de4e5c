"""The module against the program: the same bytes, progress, Ctrl-C, errors."""

import json
import os
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

import mesolux
import numpy as np
import pytest

PROGRAM = os.environ["MESOLUX"]
DEVICE = os.environ.get("MESOLUX_TEST_DEVICE", "llvmpipe")


def tensors(path: Path) -> dict[str, bytes]:
    """Bytes of each tensor of a .safetensors file."""
    data = path.read_bytes()
    (length,) = struct.unpack("<Q", data[:8])
    header = json.loads(data[8 : 8 + length])
    body = data[8 + length :]
    return {
        name: body[slice(*of["data_offsets"])]
        for name, of in header.items()
        if name != "__metadata__"
    }


@pytest.mark.parametrize("scene", ["cornell-box", "cornell-relief"])
def test_the_bytes_are_those_of_the_program(tmp_path: Path, scene: str) -> None:
    size = [] if scene == "cornell-box" else ["--patches", "8000"]
    by_program, by_module = tmp_path / "program.safetensors", tmp_path / "module.safetensors"
    command = [PROGRAM, "bake", scene, "--quality", "preview", "--no-cache", *size]
    command += ["--device", DEVICE, "-q", "-o", str(by_program)]
    subprocess.run(command, check=True)
    bake = mesolux.bake(
        scene,
        quality="preview",
        patches=8000 if size else None,
        device=DEVICE,
    )
    bake.save(by_module)
    wanted = tensors(by_program)
    assert tensors(by_module) == wanted
    assert sorted(bake.keys()) == sorted(wanted)
    assert all(np.ascontiguousarray(bake[name]).tobytes() == wanted[name] for name in wanted)
    assert bake.irradiance.shape == (len(bake), 3) and bake.irradiance.dtype == np.float32
    assert bake.material.dtype == np.uint32
    power = (bake.irradiance * bake.area[:, None]).sum(axis=0)
    assert (power > 0).all()
    assert bake.report["elements"] == len(bake)


def test_progress_is_reported_and_stops() -> None:
    seen: list[mesolux.Progress] = []

    def go_on(state: mesolux.Progress) -> bool:
        seen.append(state)
        return len(seen) < 2

    bake = mesolux.bake("cornell", patches=8000, device=DEVICE, progress=go_on)
    assert len(seen) == 2 and seen[1].sources_drawn > 0
    assert bake.report["stop"] != "Residual"
    assert bake.irradiance.max() > 0


def test_an_error_of_progress_is_raised() -> None:
    def fails(_: mesolux.Progress) -> bool:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        mesolux.bake("cornell-box", device=DEVICE, progress=fails)


def test_ctrl_c_raises_keyboard_interrupt() -> None:
    program = (
        "import mesolux, signal, sys\n"
        # A job in the background begins with it ignored.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "def report(state): print('begun', flush=True)\n"
        f"try: mesolux.bake('cornell', patches=60000, device={DEVICE!r}, progress=report)\n"
        "except KeyboardInterrupt: sys.exit(42)\n"
    )
    child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    assert child.stdout.readline() == "begun\n"
    time.sleep(0.2)
    child.send_signal(signal.SIGINT)
    assert child.wait(60) == 42


@pytest.mark.parametrize(
    ("settings", "error", "text"),
    [
        ({"scene": "no-such.toml"}, ValueError, "no-such.toml"),
        ({"scene": "cornell", "quality": "best"}, ValueError, "preview, draft"),
        ({"scene": "cornell", "directions": 7}, ValueError, "16, 32, 64"),
        ({"scene": "cornell", "residual": -1.0}, ValueError, "residual"),
        ({"scene": "cornell", "budget": -1.0}, ValueError, "budget"),
        ({"scene": "cornell", "device": "no such device"}, Exception, "no such device"),
    ],
)
def test_what_cannot_be_is_refused(settings: dict, error: type, text: str) -> None:
    with pytest.raises(error, match=text):
        mesolux.bake(**settings)
    with pytest.raises(AttributeError):
        mesolux.bake("cornell-box", quality="preview", device=DEVICE).no_such_array
