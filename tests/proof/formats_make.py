"""Writes the binary-format samples in tests/recordings with common Python packages, reads them back with these
packages and prints the sum of each channel, which expected.toml must contain.

pip install scipy==1.17.1 pyuff==2.5.8 && python tests/proof/formats_make.py tests/recordings
"""

import sys
from pathlib import Path

import numpy as np
import pyuff
from scipy.io import loadmat, savemat, wavfile

folder = Path(sys.argv[1])
rate = 2000
t = np.arange(40) / rate
torque = 0.5 * np.cos(2 * np.pi * 60 * t) + 0.1
speed = 100 + 5 * np.sin(2 * np.pi * 30 * t)

# WAV: fractions of full scale.
both = np.stack([torque, -0.25 * torque], axis=1)
wavfile.write(folder / "scipy_16_bit.wav", rate, np.round(both * 32767).astype(np.int16))
wavfile.write(folder / "scipy_32_bit.wav", rate, np.round(torque * 2147483647).astype(np.int32))
wavfile.write(folder / "scipy_float.wav", rate, torque.astype(np.float32))
for name in ["scipy_16_bit", "scipy_32_bit", "scipy_float"]:
    read_rate, samples = wavfile.read(folder / f"{name}.wav")
    full = {np.dtype("int16"): 2.0**15, np.dtype("int32"): 2.0**31}.get(samples.dtype, 1.0)
    print(name, read_rate, np.atleast_2d(samples.T).astype(float).sum(axis=1) / full)

# MATLAB 5: a time vector, or a rate.
savemat(folder / "scipy_time.mat", {"time_s": t, "torque_Nm": torque, "speed": speed, "note": "a text", "gain": 10.0})
savemat(
    folder / "scipy_rate_compressed.mat",
    {"fs": 2000, "bridge_V": torque[:, None], "counts": np.round(1000 * torque).astype(np.int16)},
    do_compression=True,
)
for name in ["scipy_time", "scipy_rate_compressed"]:
    read = loadmat(folder / f"{name}.mat")
    print(name, {key: float(v.sum()) for key, v in read.items() if not key.startswith("__") and v.size > 1})


def function(values, binary, number, **more):
    return {
        "type": 58,
        "binary": binary,
        "func_type": 1,
        "rsp_node": number,
        "rsp_dir": 3,
        "ref_node": 1,
        "ref_dir": 3,
        "id1": f"channel {number}",
        "ord_data_type": 4,
        "abscissa_spacing": 1,
        "abscissa_min": 0.0,
        "abscissa_inc": 1 / rate,
        "abscissa_spec_data_type": 17,
        "abscissa_axis_lab": "Time",
        "abscissa_axis_units_lab": "s",
        "data": values,
        "x": t,
        "orddenom_spec_data_type": 0,
        "z_axis_spec_data_type": 0,
        "z_axis_axis_lab": "",
        **more,
    }


for name, binary in [("pyuff_58", 0), ("pyuff_58b", 1)]:
    path = folder / f"{name}.uff"
    path.unlink(missing_ok=True)
    file = pyuff.UFF(str(path))
    volts = {"ordinate_axis_lab": "Bridge", "ordinate_axis_units_lab": "V"}
    file.write_sets(function(torque, binary, 1, **volts), "add")
    file.write_sets(function(speed, binary, 2, ordinate_axis_lab="Speed", ordinate_axis_units_lab="rpm"), "add")
    spectrum = function(np.fft.rfft(torque), binary, 3)
    spectrum.update(func_type=4, ord_data_type=6, abscissa_spec_data_type=18, x=np.fft.rfftfreq(40, 1 / rate), abscissa_inc=50.0)
    file.write_sets(spectrum, "add")
    print(name, [float(np.real(s["data"]).sum()) for s in pyuff.UFF(str(path)).read_sets()])
