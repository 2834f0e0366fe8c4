"""Messages with arrays that a page of the explorer contains, read independently of its scripts."""

import base64
import json
import math
import struct
import zlib

import numpy as np


def messages(stored):
    """Return (head, arrays) of each message that a page contains."""
    found = []
    for text in stored:
        content = zlib.decompress(base64.b64decode(text))
        (size,) = struct.unpack("<i", content[:4])
        head, data = json.loads(content[4 : 4 + size]), content[4 + size :]
        arrays = {
            name: np.frombuffer(data, "<" + kind, math.prod(shape), place).reshape(shape)
            for name, (kind, shape, place) in head["arrays"].items()
        }
        found.append((head, arrays))
    return found
