"""A film of moving patterns within an oval, as the pair of image and inverted mask that `heliodon key` makes: for measurements, with ffmpeg."""

import subprocess


def make_pair(image, mask, size, rate, seconds):
    """Writes both, H.264, `size` as 640x1280, `rate` frames a second."""
    width, height = map(int, size.split("x"))
    oval = f"255*gt(hypot((X-{width / 2})/{0.47 * width},(Y-{height / 2})/{0.5 * height}),1)"
    shape = f"size={size}:rate={rate}:duration={seconds}"
    graph = (
        f"color=black:{shape},format=gray,geq=lum='{oval}'[mask];[mask]split[mask1][mask2];[mask1]negate[cover];"
        f"testsrc2={shape},format=gbrp[colours];[cover]format=gbrp[cover3];[colours][cover3]blend=all_mode=multiply,format=yuv420p[image];"
        f"[mask2]format=yuv420p[inverted]"
    )
    encoder = ["-c:v", "libx264", "-crf", "14", "-g", "30"]
    command = ["ffmpeg", "-v", "error", "-nostdin", "-y", "-filter_complex", graph]
    command += ["-map", "[image]", *encoder, str(image), "-map", "[inverted]", *encoder, str(mask)]
    subprocess.run(command, check=True)
