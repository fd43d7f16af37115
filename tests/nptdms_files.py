"""Writes tests/recordings/nptdms_*.tdms with npTDMS, and prints what npTDMS reads from them: count and sum of each channel.

    pip install npTDMS==1.13.0 numpy && python3 tests/nptdms_files.py

The numbers stand in tests/recordings/expected.toml as torqcomp reads them.
"""

from pathlib import Path

import numpy as np
from nptdms import ChannelObject, GroupObject, RootObject, TdmsFile, TdmsWriter
from nptdms.timestamp import TdmsTimestamp

FOLDER = Path(__file__).parent / "recordings"
START = TdmsTimestamp(3_790_000_000, 1 << 62)  # 2024-02-05T17:46:40.25Z
i = np.arange(60)
WAVE = np.sin(0.1 * i) + 0.25


def waveform(step=5e-4, unit="V", **more):
    properties = {
        "wf_start_time": START,
        "wf_start_offset": 0.0,
        "wf_increment": step,
        "wf_samples": len(WAVE),
        "wf_xname": "Time",
        "wf_xunit_string": "s",
        "unit_string": unit,
    }
    return {**properties, **more}


def scales(*each, status="unscaled"):
    """Properties of a chain of scales: a type and its keys, of which numbers in a list have places."""
    found = {"NI_Scaling_Status": status, "NI_Number_Of_Scales": np.uint32(len(each))}
    for number, (kind, keys) in enumerate(each):
        found[f"NI_Scale[{number}]_Scale_Type"] = kind
        for key, value in keys.items():
            name = f"NI_Scale[{number}]_{kind}_{key}"
            if isinstance(value, list):
                found[f"{name}_Size"] = np.uint32(len(value))
                for place, one in enumerate(value):
                    found[f"{name}[{place}]"] = one
            else:
                found[name] = np.uint32(value) if isinstance(value, int) else value
    return found


RAW = 0xFFFFFFFF
LINEAR = ("Linear", {"Slope": 2.5e-4, "Y_Intercept": -0.5, "Input_Source": RAW})
STRAIN = {
    "Poisson_Ratio": 0.3,
    "Gage_Resistance": 350.0,
    "Lead_Wire_Resistance": 0.7,
    "Initial_Bridge_Voltage": 1e-4,
    "Gage_Factor": 2.1,
    "Bridge_Shunt_Calibration_Gain_Adjustment": 1.01,
    "Voltage_Excitation": 5.0,
}
CHAINS = {
    "linear": [LINEAR],
    "polynomial": [("Polynomial", {"Coefficients": [1.0, 2e-3, -3e-7], "Input_Source": RAW})],
    "table": [("Table", {"Pre_Scaled_Values": [-500.0, 0.0, 1500.0], "Scaled_Values": [10.0, 20.0, 80.0], "Input_Source": RAW})],
    "falling table": [("Table", {"Pre_Scaled_Values": [900.0, 0.0, -400.0], "Scaled_Values": [1.0, 2.0, 8.0], "Input_Source": RAW})],
    "linear and polynomial": [LINEAR, ("Polynomial", {"Coefficients": [0.5, 3.0], "Input_Source": 0})],
    "sum": [LINEAR, ("Linear", {"Slope": 1.0, "Y_Intercept": 3.0, "Input_Source": RAW}),
            ("Add", {"Left_Operand_Input_Source": 0, "Right_Operand_Input_Source": 1})],
    "difference": [LINEAR, ("Linear", {"Slope": 1.0, "Y_Intercept": 3.0, "Input_Source": RAW}),
                   ("Subtract", {"Left_Operand_Input_Source": 0, "Right_Operand_Input_Source": 1})],
    "RTD": [("Linear", {"Slope": 2e-5, "Y_Intercept": 0.1, "Input_Source": RAW}),
            ("RTD", {"Current_Excitation": 1e-3, "R0_Nominal_Resistance": 100.0, "A": 3.9083e-3, "B": -5.775e-7,
                     "C": -4.183e-12, "Lead_Wire_Resistance": 0.2, "Resistance_Configuration": 3, "Input_Source": 0})],
    "thermistor": [("Linear", {"Slope": 1e-4, "Y_Intercept": 1.0, "Input_Source": RAW}),
                   ("Thermistor", {"Excitation_Type": 10322, "Excitation_Value": 2.5, "Resistance_Configuration": 2,
                                   "R1_Reference_Resistance": 5000.0, "Lead_Wire_Resistance": 0.0, "A": 1.295361e-3,
                                   "B": 2.343159e-4, "C": 1.018703e-7, "Temperature_Offset": 273.15, "Input_Source": 0})],
    **{
        f"strain {code}": [("Linear", {"Slope": 1e-5, "Y_Intercept": 0.0, "Input_Source": RAW}),
                           ("Strain", {"Configuration": code, **STRAIN, "Input_Source": 0})]
        for code in (10183, 10184, 10185, 10188, 10189, 10271, 10272)
    },
}
COUNTS = np.round(1000 * WAVE).astype(np.int16)


def write(name, *segments, version=4713):
    path = FOLDER / f"nptdms_{name}.tdms"
    with TdmsWriter(path, version=version) as writer:
        for objects in segments:
            writer.write_segment(objects)
    for channel in (c for group in TdmsFile.read(path).groups() for c in group.channels()):
        if channel.data.dtype.kind in "biuf":
            print(f"{path.name} {channel.path} {len(channel)} {channel.data.astype(float).sum():.12g}")


def main():
    kinds = ["i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f4", "f8"]
    of_kind = [np.round(40 * WAVE + 40).astype(kind) for kind in kinds]
    write("types", [ChannelObject("numbers", kind, data, waveform(unit="N m"))
                    for kind, data in zip(kinds, of_kind)], version=4712)
    root = RootObject({"title": "free decay", "Operator": "A. N. Other"})
    group = GroupObject("stand's data", {"location": "cell 3"})
    parts = [(root, group, ChannelObject("stand's data", "bridge", WAVE[:25], waveform(unit="mV")),
              ChannelObject("stand's data", "slow", WAVE[:5], waveform(2.5e-3, "degC"))),
             (ChannelObject("stand's data", "bridge", WAVE[25:50]), ChannelObject("stand's data", "slow", WAVE[5:10])),
             (ChannelObject("stand's data", "bridge", WAVE[50:]), ChannelObject("stand's data", "remark", ["begun", "ended"]))]
    write("segments", *parts)
    stamps = np.datetime64("2024-02-05T17:46:40.250000") + np.arange(60) * np.timedelta64(500, "us")
    write("timestamps", [ChannelObject("log", "stamp", stamps), ChannelObject("log", "torque", WAVE, {"unit_string": "N m"}),
                         ChannelObject("other", "Time", 1e-3 * i, {"unit_string": "s"}),
                         ChannelObject("other", "angle", WAVE, {"unit_string": "deg"})])
    write("scales", [ChannelObject("scaled", name, COUNTS, waveform(unit="", **scales(*chain)))
                     for name, chain in CHAINS.items()])
    left = [ChannelObject("scaled", "thermocouple", COUNTS, waveform(unit="degC", **scales(("Thermocouple", {"Input_Source": RAW})))),
            ChannelObject("scaled", "done", WAVE, waveform(**scales(LINEAR, status="scaled"))),
            ChannelObject("scaled", "switch", WAVE > 0, waveform(unit=""))]
    write("unknown_scale", left)


main()
