"""How far light maps of one scene are from a better one of it, as parts of its mean.

  python scripts/lightmap/texel_error.py REFERENCE FOLDER...

Folders are those of `cargo run -p heliodon_lightmap --example truth_scene`, all of one scene and size. Covered and valid texels count.
"""
import json
import sys

import numpy as np


def light(folder):
    ok = np.fromfile(f"{folder}/texel_flags.u8", "u1").astype(bool)
    return np.fromfile(f"{folder}/light.f32", "<f4").reshape(-1, 3).astype(np.float64), ok


truth, ok = light(sys.argv[1])
for folder in sys.argv[2:]:
    found, also = light(folder)
    both = ok & also
    off = (found - truth)[both]
    mean = truth[both].mean()
    print(json.dumps({"folder": folder, "texels": int(both.sum()), "rmse_of_mean": round(float(np.sqrt((off**2).mean()) / mean), 5),
                      "bias_of_mean": round(float(off.mean() / mean), 5), "p99_of_mean": round(float(np.quantile(np.abs(off).max(1), 0.99) / mean), 4)}))
