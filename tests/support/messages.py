"""Messages with arrays that a page of the explorer contains, read independently of its scripts."""

import base64
import json
import math
import struct
import zlib

import numpy as np


def messages(stored):
    """Return (head, arrays) of each message that a page contains, by another decoder."""
    content, found = zlib.decompress(base64.b64decode(stored)), []
    while content:
        (length,), content = struct.unpack("<i", content[:4]), content[4:]
        message, content = content[:length], content[length:]
        (size,), rest = struct.unpack("<i", message[:4]), message[4:]
        head, data = json.loads(rest[:size]), rest[size:]
        arrays = {
            name: np.frombuffer(data, "<" + kind, math.prod(shape), place).reshape(shape)
            for name, (kind, shape, place) in head["arrays"].items()
        }
        found.append((head, arrays))
    return found
