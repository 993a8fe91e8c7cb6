#!/usr/bin/env python3
"""What one pass of the z-buffer takes Mesa's llvmpipe, as `cargo bench -p farfield-benches -- passes` says
it for our renderer: 512 x 512 pixels, 45 degrees, depth and the number of the triangle at each pixel.

    apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri
    pip install moderngl numpy
    LP_NUM_THREADS=2 python3 benches/llvmpipe.py dragon.glb 0,0.12,0.5

Reads glTF files with one buffer inside, indexed triangles and nodes that are not moved.
"""

import json
import os
import struct
import sys
import time

os.environ.setdefault("LIBGL_ALWAYS_SOFTWARE", "1")
import moderngl
import numpy as np

SIZE = 512
REPEATS = 15
KINDS = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}


def read(path):
    """Positions and indices of all triangles of a GLB file."""
    data = open(path, "rb").read()
    length = struct.unpack_from("<I", data, 12)[0]
    gltf, blob = json.loads(data[20 : 20 + length]), data[28 + length :]

    def accessor(number):
        found = gltf["accessors"][number]
        view = gltf["bufferViews"][found["bufferView"]]
        assert "byteStride" not in view or view["byteStride"] == 12, "interleaved"
        start = view.get("byteOffset", 0) + found.get("byteOffset", 0)
        width = {"SCALAR": 1, "VEC3": 3}[found["type"]]
        kind = KINDS[found["componentType"]]
        return np.frombuffer(blob, kind, found["count"] * width, start)

    moved = {"matrix", "translation", "rotation", "scale"}
    assert not any(moved & set(node) for node in gltf["nodes"]), "a node is moved"
    positions, indices, count = [], [], 0
    for primitive in (p for mesh in gltf["meshes"] for p in mesh["primitives"]):
        positions.append(accessor(primitive["attributes"]["POSITION"]).reshape(-1, 3))
        indices.append(accessor(primitive["indices"]).astype(np.uint32) + np.uint32(count))
        count += len(positions[-1])
    return np.concatenate(positions), np.concatenate(indices)


def clip_from_world(eye, target, near, far):
    """A camera that looks at a target with +Y up, row by row."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0, 1, 0])
    right /= np.linalg.norm(right)
    view = np.eye(4)
    view[:3, :3] = [right, np.cross(right, forward), -forward]
    view[:3, 3] = -view[:3, :3] @ eye
    scale = 1 / np.tan(np.radians(45) / 2)
    depth = [(far + near) / (near - far), 2 * far * near / (near - far)]
    lens = [[scale, 0, 0, 0], [0, scale, 0, 0], [0, 0, *depth], [0, 0, -1, 0]]
    return np.array(lens) @ view


positions, indices = read(sys.argv[1])
eye = np.array([float(part) for part in sys.argv[2].split(",")])
low, high = positions.min(axis=0).astype(float), positions.max(axis=0).astype(float)
reach = np.linalg.norm(high - low)
distance = np.linalg.norm((low + high) / 2 - eye)
matrix = clip_from_world(eye, (low + high) / 2, max(distance - reach, reach / 100), distance + reach)

context = moderngl.create_standalone_context(backend="egl")
renderer = context.info["GL_RENDERER"]
assert "llvmpipe" in renderer, renderer
program = context.program(
    vertex_shader="""#version 330
        uniform mat4 clip_from_world; in vec3 position;
        void main() { gl_Position = clip_from_world * vec4(position, 1.0); }""",
    fragment_shader="""#version 330
        out uint triangle; void main() { triangle = uint(gl_PrimitiveID) + 1u; }""",
)
program["clip_from_world"].write(matrix.T.astype("f4").tobytes())
target = context.texture((SIZE, SIZE), 1, dtype="u4")
picture = context.framebuffer([target], context.depth_renderbuffer((SIZE, SIZE)))
mesh = context.vertex_array(
    program, [(context.buffer(positions.tobytes()), "3f", "position")],
    context.buffer(indices.tobytes()),
)
picture.use()
context.enable_only(moderngl.DEPTH_TEST)
times = []
for _ in range(REPEATS):
    start = time.perf_counter()
    picture.clear()
    mesh.render()
    context.finish()
    times.append(time.perf_counter() - start)
covered = np.count_nonzero(np.frombuffer(target.read(), np.uint32)) / SIZE**2
best, count = min(times), len(indices) // 3
print(f"{renderer}: {count} triangles, {best * 1e3:.1f} ms, {best * 1e9 / count:.0f} ns a triangle, "
      f"{covered:.1%} of the pixels covered")
