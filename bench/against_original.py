#!/usr/bin/env python3
"""against_original.py ORIGINAL TRAMMEL RECORDING... [--noise GREY] [--rounds N]

Processor's time of the paper's own program and of `trammel pa analyze` on the same recordings, in turns.

ORIGINAL is a folder with the files of github.com/furrysalamander/rubedo, fetched by hand; it reads videos of
1280x720 around its own crop. RECORDING is a folder of whole frames, as of `trammel sim scan` or
`trammel pa calibrate --keep-full`. --quality stores copies of the frames as a camera with another JPEG quality does,
--noise with normal noise of so many grey values added: --quality 50 makes frames of some 20 kB of a dark scene,
--quality 95 --noise 3 some of 250 kB of a bright one. Wants python3-opencv. The original's time is that of
its heights and scores alone, its start left out; trammel's is that of the whole program.
"""
import argparse
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile

import cv2
import numpy

# Run by itself, so that the original's modules meet nothing of this one; prints seconds and frames.
ORIGINAL_RUN = """
import sys, time
sys.path.insert(0, sys.argv[1])
import analysis
begin = time.process_time()
frames = sum(len(analysis.pa_score_from_video_file(video).height_data) for video in sys.argv[2:])
print(time.process_time() - begin, frames)
"""


def videos_of(recording):
    lines = json.loads((recording / "scan.json").read_text())["lines"]
    return sorted({recording / line["video"] for line in lines})


def chunk(name, data):
    return name + struct.pack("<I", len(data)) + data + b"\0" * (len(data) % 2)


def write_avi(path, jpegs, rate, width, height):
    """MJPEG in AVI."""
    longest = max(map(len, jpegs))
    avih = struct.pack("<14I", round(1e6 / rate), 0, 0, 0x10, len(jpegs), 0, 1, longest, width, height, 0, 0, 0, 0)
    strh = struct.pack("<4s4sIHHIIIIIIIIHHHH", b"vids", b"MJPG", 0, 0, 0, 0, 1000, round(1000 * rate), 0, len(jpegs),
                       longest, 0, 0, 0, 0, width, height)
    strf = struct.pack("<IiiHH4sIiiII", 40, width, height, 1, 24, b"MJPG", 3 * width * height, 0, 0, 0, 0)
    stream = chunk(b"LIST", b"strl" + chunk(b"strh", strh) + chunk(b"strf", strf))
    frames, index = [b"movi"], []
    at = 4
    for jpeg in jpegs:
        frames.append(chunk(b"00dc", jpeg))
        index.append(struct.pack("<4sIII", b"00dc", 0x10, at, len(jpeg)))
        at += len(frames[-1])
    body = (b"AVI " + chunk(b"LIST", b"hdrl" + chunk(b"avih", avih) + stream) + chunk(b"LIST", b"".join(frames)) +
            chunk(b"idx1", b"".join(index)))
    path.write_bytes(chunk(b"RIFF", body))


def copy_of(recording, quality, grey, folder):
    """A copy of the recording below `folder`, of that JPEG quality and with noise in every frame."""
    copy = folder / recording.name
    copy.mkdir()
    for file in recording.iterdir():
        if file.suffix != ".avi":
            shutil.copy(file, copy)
    random = numpy.random.default_rng(1)
    for video in videos_of(recording):
        source = cv2.VideoCapture(str(video))
        rate = source.get(cv2.CAP_PROP_FPS)
        jpegs = []
        while True:
            there, frame = source.read()
            if not there:
                break
            if grey > 0:
                noise = random.standard_normal(frame.shape, dtype=numpy.float32) * numpy.float32(grey)
                frame = numpy.clip(frame + noise, 0, 255).astype(numpy.uint8)
            jpegs.append(cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes())
        width, height = (int(source.get(size)) for size in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
        write_avi(copy / video.name, jpegs, rate, width, height)
    return copy


def original_s(original, recording):
    run = [sys.executable, "-c", ORIGINAL_RUN, original, *map(str, videos_of(recording))]
    seconds, frames = subprocess.run(run, check=True, capture_output=True, text=True).stdout.split()
    return float(seconds), int(frames)


def trammel_s(trammel, recording):
    child = subprocess.Popen([trammel, "pa", "analyze", recording, "--json"], stdout=subprocess.PIPE)
    answer = child.stdout.read()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if not answer:
        sys.exit(f"against_original.py: {trammel} says nothing on {recording}")
    return usage.ru_utime + usage.ru_stime, json.loads(answer)


def compare(arguments, recording):
    original, trammel, frames = [], [], 0
    for _ in range(arguments.rounds):
        seconds, frames = original_s(arguments.original, recording)
        original.append(seconds)
        seconds, answer = trammel_s(arguments.trammel, recording)
        trammel.append(seconds)
    kilobytes = 1e-3 * sum(video.stat().st_size for video in videos_of(recording)) / frames
    print(f"{recording.name}: {frames} frames of {kilobytes:.0f} kB; frames a second of the processor's time: "
          f"original {frames / min(original):.0f}, trammel {frames / min(trammel):.0f}, "
          f"{min(original) / min(trammel):.1f} times; trammel says {answer['verdict']} "
          f"{answer.get('pressure_advance_s')}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("original")
    parser.add_argument("trammel")
    parser.add_argument("recording", nargs="+", type=pathlib.Path)
    parser.add_argument("--quality", type=int)
    parser.add_argument("--noise", type=float, default=0)
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    for recording in arguments.recording:
        if arguments.quality or arguments.noise > 0:
            with tempfile.TemporaryDirectory() as folder:
                quality = arguments.quality or 95
                compare(arguments, copy_of(recording, quality, arguments.noise, pathlib.Path(folder)))
        else:
            compare(arguments, recording)


if __name__ == "__main__":
    main()
