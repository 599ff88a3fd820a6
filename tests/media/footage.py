"""Ugly media files, made at test time. Every picture carries its number as eight black or white blocks."""

import struct
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from OpenImageIO import ImageOutput, ImageSpec

from shutter_addon.core.frames.frame_source import FrameSource
from shutter_addon.core.messages import MediaError

WIDTH, HEIGHT, BLOCK = 128, 64, 16
COUNT = 36
VARIABLE = [n * n // 8 + n for n in range(24)]  # when a frame begins, in 25ths of a second


class Film(FrameSource):
    """Frames of a function of their number. It notes which are read; `lost` ones cannot be."""

    transfer, alpha, options, fps, path = "srgb", "opaque", {}, 25, Path("film.mov")

    def __init__(self, shows, count):
        self.shows, self.count, self.asked, self.lost = shows, count, [], set()
        first = shows(0)
        (self.height, self.width), self.dtype = first.shape[:2], first.dtype

    def read(self, index):
        if index in self.lost:
            raise MediaError(f"frame {index} is lost")
        self.asked.append(index)
        return self.shows(index)


def picture(number, width=WIDTH, height=HEIGHT):
    """The uint8 RGB picture of that number: its bits in the upper rows, a moving colored ramp below."""
    y, x = np.mgrid[:height, :width]
    ramp = np.stack([x * 2 + number, y * 4 + number * 3, 255 - x - y], -1) % 256
    bits = (number >> np.minimum(x // BLOCK, 7)) & 1
    return np.where((y < BLOCK)[..., None], (bits * 255)[..., None], ramp).astype(np.uint8)


def see_through(number):
    """The picture of that number as RGBA, clear at the left and opaque at the right."""
    alpha = np.broadcast_to(np.linspace(0, 255, WIDTH).astype(np.uint8), (HEIGHT, WIDTH))
    return np.dstack([picture(number), alpha])


def number(pixels):
    """The number that a picture shows, whatever its sample type."""
    levels = pixels[BLOCK // 2, BLOCK // 2 : 8 * BLOCK : BLOCK, 0].astype(float)
    top = np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 1.0
    return sum(1 << bit for bit, level in enumerate(levels) if level > top / 2)


def make_movie(
    path, codec, count=COUNT, *, pix_fmt="yuv420p", rate=25, times=None, options=None, mux=None, size=None, **more
):
    """Encodes pictures 0 … count-1 at `times`, in frames of the rate. options, mux: the encoder's and the muxer's.

    more: format (the container's), pictures and array_format (arrays to encode in place of the numbered ones),
    tags (colorspace, color_range, color_trc, color_primaries), seconds (of silence beside the pictures)."""
    size = size or (WIDTH, HEIGHT)
    arrays = more.get("pictures") or [picture(n, *size) for n in range(count)]
    with av.open(str(path), "w", format=more.get("format"), options=mux or {}) as out:
        stream = out.add_stream(codec, rate=rate, options=options or {})
        stream.width, stream.height, stream.pix_fmt = *size, pix_fmt
        stream.time_base = stream.codec_context.time_base = 1 / Fraction(rate)
        for name, value in more.get("tags", {}).items():
            setattr(stream.codec_context, name, value)
        _write_silence(out, more.get("seconds", 0))
        for array, time in zip(arrays, times or range(len(arrays)), strict=True):
            frame = av.VideoFrame.from_ndarray(array, format=more.get("array_format", "rgb24"))
            frame.pts, frame.time_base = time, 1 / Fraction(rate)
            # one thread: with more, the way from RGB to deep YUV spoils some pixels now and then
            out.mux(stream.encode(frame.reformat(format=pix_fmt, threads=1)))
        out.mux(stream.encode())
    return path


def save_parts(path, *parts):
    """Writes an EXR of parts: each an array (height, width, channels), the channels' names and their sample types."""
    specs = [ImageSpec(*array.shape[1::-1], len(names), kinds[0]) for array, names, kinds in parts]
    for number, (spec, (_, names, kinds)) in enumerate(zip(specs, parts, strict=True)):
        spec.channelnames, spec.channelformats = names, kinds
        spec.attribute("oiio:subimagename", f"part{number}")
    out = ImageOutput.create(str(path))
    assert out.open(str(path), tuple(specs)), out.geterror()
    for number, (spec, (array, *_)) in enumerate(zip(specs, parts, strict=True)):
        assert not number or out.open(str(path), spec, "AppendSubimage"), out.geterror()
        assert out.write_image(np.ascontiguousarray(array)), out.geterror()
    out.close()
    return path


def _write_silence(out, seconds):
    if not seconds:
        return
    sound = out.add_stream("pcm_s16le", rate=8000, layout="mono")
    for second in range(seconds):
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 8000), np.int16), format="s16", layout="mono")
        frame.sample_rate, frame.pts = 8000, second * 8000
        out.mux(sound.encode(frame))


def copy_movie(source, path, *, later=0, drop=0, stamped=None):
    """Copies the packets but the first `drop`, `later` frames (of the 25ths) later; earlier ones make an edit list.
    stamped: the time of each packet, in frames, by its number, in place of its own"""
    with av.open(str(source)) as movie, av.open(str(path), "w", options={"avoid_negative_ts": "disabled"}) as out:
        stream = out.add_stream_from_template(movie.streams.video[0])
        shift = round(later / 25 / movie.streams.video[0].time_base)
        for position, packet in enumerate(movie.demux(video=0)):
            if packet.size and position >= drop:
                packet.pts, packet.dts, packet.stream = packet.pts + shift, packet.dts + shift, stream
                if stamped:
                    times = stamped(position), position - 100  # which must not go back, nor be later
                    packet.pts, packet.dts = (round(time / 25 / packet.time_base) for time in times)
                out.mux(packet)
    return path


def rotate_movie(source, path, degrees):
    """Copies an MP4 file and writes into its track header that it is to be turned clockwise."""
    data = bytearray(source.read_bytes())
    cos, sin = {90: (0, 1), 180: (-1, 0), 270: (0, -1)}[degrees]
    matrix = cos << 16, sin << 16, 0, -sin << 16, cos << 16, 0, 0, 0, 1 << 30
    start = data.index(b"tkhd") + 44
    data[start : start + 36] = struct.pack(">9i", *matrix)
    path.write_bytes(data)
    return path


def cut_file(source, path, end):
    """Copies the file up to that fraction of its length, or up to the last place of those bytes."""
    data = source.read_bytes()
    path.write_bytes(data[: data.rindex(end) if isinstance(end, bytes) else round(len(data) * end)])
    return path


def damage_frame(source, path, index):
    """Copies the movie and overwrites the frame's packet (in decoding order) with noise, but its first bytes."""
    with av.open(str(source)) as movie:
        packet = [p for p in movie.demux(video=0) if p.size][index]
        position, size = packet.pos, packet.size
    data = bytearray(source.read_bytes())
    data[position + 4 : position + size] = b"\xff" * (size - 4)
    path.write_bytes(data)
    return path


def save_image(path, array, samples="uint8", **attributes):
    """Writes an array (height, width, channels) of 0 … 1 or of whole samples; attributes' __ stands for a colon.

    names: the channels' names; alpha: which of them is; at: the data window's corner; display: the window
    (x, y, width, height)."""
    height, width, channels = array.shape
    spec = ImageSpec(width, height, channels, samples)
    if "names" in attributes:
        spec.channelnames = attributes.pop("names")
    spec.alpha_channel = attributes.pop("alpha", spec.alpha_channel)
    spec.x, spec.y = attributes.pop("at", (0, 0))
    x, y, w, h = attributes.pop("display", (0, 0, width, height))
    spec.full_x, spec.full_y, spec.full_width, spec.full_height = x, y, w, h
    for name, value in attributes.items():
        spec.attribute(name.replace("__", ":"), value)
    out = ImageOutput.create(str(path))
    assert out.open(str(path), spec), out.geterror()
    assert out.write_image(np.ascontiguousarray(array)), out.geterror()
    out.close()
    return path


LOSSLESS = {"qp": "0", "preset": "ultrafast"}
CLEAR = {"pictures": [see_through(n) for n in range(3)], "array_format": "rgba"}


def tags(space, span=1, curve=1, primaries=1):
    return {"colorspace": space, "color_range": span, "color_trc": curve, "color_primaries": primaries}


def coloured_movies(folder):
    """Movies in many formats, three frames each."""

    def movie(name, codec, pix_fmt, **more):
        return name, make_movie(folder / name, codec, 3, pix_fmt=pix_fmt, **more)

    yield movie("bt709.mp4", "libx264", "yuv420p", options=LOSSLESS, tags=tags(1))
    yield movie("bt601.mp4", "libx264", "yuv420p", options=LOSSLESS, tags=tags(5, 1, 6, 5))
    yield movie("full_range.mp4", "libx264", "yuv420p", options=LOSSLESS, tags=tags(1, 2))
    for name, pix_fmt in (("jpeg_range", "yuvj420p"), ("yuv444", "yuv444p"), ("ten_bits", "yuv420p10le")):
        yield movie(f"{name}.mp4", "libx264", pix_fmt, options=LOSSLESS)
    for name, pix_fmt in (("rgb", "bgr0"), ("gray", "gray"), ("rgb48", "rgb48le")):
        yield movie(f"{name}.mkv", "ffv1", pix_fmt)
    yield movie("mjpeg.avi", "mjpeg", "yuvj420p")
    yield movie("odd.avi", "mpeg4", "yuv420p", size=(33, 17))
    yield movie("bt2020.mkv", "ffv1", "yuv420p10le", tags=tags(9, 1, 14, 9))
    yield movie("prores.mov", "prores_ks", "yuv422p10le")
    for name, codec, pix_fmt in (
        ("alpha", "qtrle", "argb"),
        ("alpha_png", "png", "rgba"),
        ("alpha_deep", "png", "rgba64be"),
    ):
        yield movie(f"{name}.mov", codec, pix_fmt, **CLEAR)
    yield movie("alpha.webm", "libvpx-vp9", "yuva420p", options={"lossless": "1"}, **CLEAR)
    yield movie("alpha_prores.mov", "prores_ks", "yuva444p10le", options={"profile": "4444"}, **CLEAR)
    for degrees in (90, 180, 270):
        name = f"turned_{degrees}.mp4"
        yield name, rotate_movie(folder / "bt709.mp4", folder / name, degrees)
    yield "turned_deep.mp4", rotate_movie(folder / "ten_bits.mp4", folder / "turned_deep.mp4", 90)


# Codecs whose frames bear tags of their own: encoder, pixels, options, and what writes BT.709, BT.601 or nothing there.
_PRORES = "prores_metadata=color_primaries={0}:color_trc={0}:colorspace={1}"
TAGGED = dict.fromkeys(("mov", "mkv"), ("prores_ks", "yuv422p10le", {}, _PRORES, ("bt709", "smpte170m", "unknown")))
_VP9 = {"lossless": "1"}, "vp9_metadata=color_space={1}", ("bt709", "bt601", "unknown")
TAGGED |= {"webm": ("libvpx-vp9", "yuv420p", *_VP9)}
# The container's matrix, and which of the names above the frames have.
TAGS = {"both": (1, 0), "container": (1, 2), "frames": (2, 0), "neither": (2, 2), "contradicting": (1, 1)}


def tagged_movies(folder):
    """Movies whose container and whose frames say what their colors are: both, either, neither, or not the same."""
    for ending, (codec, pix_fmt, options, bits, names) in TAGGED.items():
        for which, (space, own) in TAGS.items():
            plain, path = folder / f"plain.{ending}", folder / f"{which}.{ending}"
            make_movie(plain, codec, 3, pix_fmt=pix_fmt, options=options, tags=tags(space, 1, space, space))
            primaries = "unknown" if names[own] == "unknown" else "bt709"
            yield path.name, _with_tags_in_frames(plain, path, bits.format(primaries, names[own]))


def movies_of_every_matrix(folder):
    """H.264 whose frames name each matrix of ITU-T H.273, known to libswscale or not."""
    plain = make_movie(folder / "plain.ts", "libx264", 3, options=LOSSLESS)
    bits = "h264_metadata=colour_primaries=1:transfer_characteristics=1:matrix_coefficients={}"
    for space in range(16):
        yield f"matrix_{space}.ts", _with_tags_in_frames(plain, folder / f"matrix_{space}.ts", bits.format(space))


def _with_tags_in_frames(plain, path, bits):
    """A copy of a movie, its container as it is, its packets through FFmpeg's bitstream filter."""
    with av.open(str(plain)) as source, av.open(str(path), "w") as out:
        stream = source.streams.video[0]
        copied = out.add_stream_from_template(stream)
        filtered = av.bitstream.BitStreamFilterContext(bits, stream)
        for packet in source.demux(stream):
            for made in filtered.filter(packet if packet.size else None):
                made.stream = copied
                out.mux(made)
    return path


def deinterlaced_movies(folder):
    """Movies that Blender deinterlaces in each of its ways."""
    for name, codec, pix_fmt, more in [
        *(("fields_420.avi", "mpeg4", "yuv420p", {}), ("fields_422.mkv", "ffv1", "yuv422p", {})),
        ("fields_444.mp4", "libx264", "yuv444p", {"options": LOSSLESS}),
        *(("blur_size.avi", "mpeg4", "yuv420p", {"size": (130, 66)}), ("blur_alpha.mov", "qtrle", "argb", CLEAR)),
        *(("blur_rgb.mkv", "ffv1", "bgr0", {}), ("blur_deep.mkv", "ffv1", "yuv420p10le", {})),
    ]:
        yield name, make_movie(folder / name, codec, 2, pix_fmt=pix_fmt, **more)


def ugly_movies(folder):
    """{name: (path, the number that each frame shall show, or None where only Blender knows)}."""
    h264 = {"bf": "3", "g": "12"}
    open_group = {"x264-params": "open-gop=1:keyint=12:bframes=3:scenecut=0"}
    files, plain = {}, list(range(COUNT))

    def encode(name, codec, numbers=plain, **more):
        files[name] = make_movie(folder / name, codec, **more), numbers

    encode("b_frames.mp4", "libx264", options=h264)
    for name in ("open.mkv", "open.mp4", "open.ts"):
        encode(name, "libx264", options=open_group)
    hevc = "open-gop=1:keyint=12:bframes=3:pools=none:frame-threads=1:log-level=none"
    encode("hevc.mp4", "libx265", options={"x265-params": hevc})
    encode("fields.mkv", "libx264", options={"x264-params": "tff=1:bframes=0"})  # interlaced
    encode("refresh.mp4", "libx264", options={"x264-params": "intra-refresh=1:keyint=12:bframes=0"})
    encode("mpeg4.avi", "mpeg4", [0, *plain[:-1]], options={"bf": "2", "g": "12"})  # time stamps from 1 on, start 0
    encode("mpeg4.mp4", "mpeg4", options={"bf": "2", "g": "12"})
    encode("mpeg2.mpg", "mpeg2video", None, count=100, options={"bf": "2", "g": "12"})  # many frames to a time stamp
    encode("mpeg2.ts", "mpeg2video", options={"bf": "2", "g": "12"})
    encode("vp9.webm", "libvpx-vp9", options={"g": "20", "auto-alt-ref": "1", "lag-in-frames": "16", "cpu-used": "8"})
    encode("ntsc.mov", "libx264", rate=Fraction(30000, 1001), options=h264)
    encode("film.mp4", "mpeg4", rate=Fraction(24000, 1001))
    shown = [max(n for n, time in enumerate(VARIABLE) if time <= i) for i in range(VARIABLE[-1] + 1)]
    encode("variable.mkv", "libx264", shown, count=24, times=VARIABLE, options=h264)
    encode("variable.mp4", "libx264", None, count=24, times=VARIABLE, options=h264)
    encode("sound.mkv", "libx264", plain + [COUNT - 1] * (50 - COUNT), seconds=2)
    encode("animation.gif", "gif", plain[:10], count=10, pix_fmt="rgb8")
    b_frames, open_mp4, mpeg4 = (folder / name for name in ("b_frames.mp4", "open.mp4", "mpeg4.avi"))
    files["edit_list.mp4"] = copy_movie(b_frames, folder / "edit_list.mp4", later=-7), plain[7:]
    files["late.mp4"] = copy_movie(open_mp4, folder / "late.mp4", later=20), plain
    files["late.mkv"] = copy_movie(open_mp4, folder / "late.mkv", later=20), None
    files["no_key_first.ts"] = copy_movie(folder / "open.ts", folder / "no_key_first.ts", drop=7), None
    files["no_index.avi"] = cut_file(mpeg4, folder / "no_index.avi", b"idx1"), None
    make_movie(folder / "large.mp4", "mpeg4", size=(640, 360))  # whose key frames begin a new part of the file each
    # Times that go back: B-frames stamped in the order of decoding, a clock that is set, two frames at each time, and
    # all frames at one.
    for name, source, stamped in [
        ("stamped.mkv", "b_frames.mp4", lambda number: number),
        ("set_back.mkv", "b_frames.mp4", lambda number: number - 6 * (number >= 24)),
        ("pairs.mkv", "film.mp4", lambda number: number // 2),
        ("one_time.mkv", "large.mp4", lambda number: 0),
    ]:
        files[name] = copy_movie(folder / source, folder / name, stamped=stamped), None
    return files


def movies_that_cannot_be_opened(folder, movies):
    """What ends the sentence about each, with its path. movies: ugly_movies"""

    def made(name, codec, change, **options):
        path = make_movie(folder / name, codec, 5, **options)
        path.write_bytes(change(path.read_bytes()))
        return path

    def large(data):
        where = data.index(b"strf") + 12
        assert struct.unpack_from("<2i", data, where) == (WIDTH, HEIGHT)
        return data[:where] + struct.pack("<2i", 30000, 20000) + data[where + 8 :]

    def endless(data):
        where = data.index(b"\x44\x89\x88") + 3  # the duration, in milliseconds
        return data[:where] + struct.pack(">d", 1e14) + data[where + 8 :]

    undecodable = make_movie(folder / "undecodable.mkv", "ffv1", 5)
    with av.open(str(undecodable)) as movie:
        header = bytes(movie.streams.video[0].codec_context.extradata)
    undecodable.write_bytes(undecodable.read_bytes().replace(header, header[:-4] + b"\0\0\0\0"))
    with av.open(str(folder / "song.wav"), "w") as out:
        _write_silence(out, 1)
    none, unknown = "no frame of it can be decoded", "its length is unknown; put it into an MP4 or MKV file first"
    yield "no video stream", folder / "song.wav"
    yield none, undecodable
    yield none, cut_file(movies["open.mkv"][0], folder / "head.mkv", 0.12)
    yield none, made("absurd.avi", "ffv1", large)
    yield unknown, made("raw.h264", "libx264", bytes, format="h264")
    yield unknown, made("endless.webm", "libvpx-vp9", endless)
