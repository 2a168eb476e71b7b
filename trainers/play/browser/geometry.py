"""MuJoCo's abstract scene, which the window draws, as instances of a few meshes, which browsers draw quickly."""

import functools
from typing import Any, NamedTuple

import mujoco
import numpy as np
import trimesh

from go1_mtl_gym.rotations import quat_from_matrix

TUBE, BALL, CUBE, CONE = "tube", "ball", "cube", "cone"
SIDES = 24
"""Of a tube and a cone."""
HEAD_LENGTH, HEAD_WIDTH = 5.0, 2.2
"""Of an arrow's head, as multiples of the shaft's radius."""


CLEAR_SHADE = 0.55
"""How dark what one sees through is made: in viser's light its colors would else go white."""


class Instance(NamedTuple):
    """One mesh at one place.

    Attributes:
        shape: name of the mesh, as `unit_mesh` has it.
        position_w: in the world of the scene [m], shape (3,).
        rotation: from the mesh's axes to the world's, shape (3, 3).
        scale: along the mesh's axes, shape (3,).
        rgba: color, each part in [0, 1], shape (4,).
    """

    shape: str
    position_w: np.ndarray
    rotation: np.ndarray
    scale: tuple[float, float, float]
    rgba: np.ndarray


def instances(scene: mujoco.MjvScene) -> list[Instance]:
    """What is to be drawn of a scene; planes, which are endless, are left out.

    Args:
        scene: filled by MuJoCo and `trainers.play.scene.furnish`.
    """
    drawn: list[Instance] = []
    for geom in scene.geoms[: scene.ngeom]:
        if geom.rgba[3] > 0.0:
            drawn += _instances_of(geom)
    return drawn


def _instances_of(geom: mujoco.MjvGeom) -> list[Instance]:
    """A geom in parts whose shape does not depend on its size."""
    kind, rotation, rgba = mujoco.mjtGeom(geom.type), geom.mat.reshape(3, 3).astype(float), geom.rgba
    x, y, z = (float(each) for each in geom.size)
    axis = rotation[:, 2]

    def part(shape: str, scale: tuple[float, float, float], up: float = 0.0) -> Instance:
        return Instance(shape, geom.pos + up * axis, rotation, scale, rgba)

    if kind in (mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_ELLIPSOID):
        return [part(BALL, (x, y, z))]
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return [part(TUBE, (x, x, z)), part(BALL, (x, x, x), z), part(BALL, (x, x, x), -z)]
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return [part(TUBE, (x, x, z))]
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return [part(CUBE, (x, y, z))]
    if kind == mujoco.mjtGeom.mjGEOM_ARROW:
        head = min(HEAD_LENGTH * x, z)
        shaft, width = (z - head) / 2.0, HEAD_WIDTH * x
        return [part(TUBE, (x, x, shaft), shaft), part(CONE, (width, width, head), z - head)]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        return [part(f"mesh {geom.dataid // 2}", (1.0, 1.0, 1.0))]  # odd ones are convex hulls
    return []


def unit_mesh(shape: str, model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    """Vertices, shape (v, 3), and faces, shape (f, 3), of a mesh.

    Those that are not the model's reach from -1 to 1 along every axis, but for the cone, which stands on the origin and
    is one high.

    Args:
        shape: "tube", "ball", "cube", "cone", or "mesh" and its number in the model.
        model: for its meshes.
    """
    if shape.startswith("mesh "):
        number = int(shape.split()[1])
        first, count = model.mesh_vertadr[number], model.mesh_vertnum[number]
        first_face, face_count = model.mesh_faceadr[number], model.mesh_facenum[number]
        return model.mesh_vert[first : first + count], model.mesh_face[first_face : first_face + face_count]
    mesh = _primitive(shape)
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


@functools.cache
def _primitive(shape: str) -> Any:
    if shape == TUBE:
        return trimesh.creation.cylinder(radius=1.0, height=2.0, sections=SIDES)
    if shape == BALL:
        return trimesh.creation.icosphere(subdivisions=2, radius=1.0)
    if shape == CONE:
        return trimesh.creation.cone(radius=1.0, height=1.0, sections=SIDES)
    return trimesh.creation.box(extents=(2.0, 2.0, 2.0))


class Mirror:
    """Keeps a scene of viser's equal to one of MuJoCo's.

    Instances of the same mesh are one node; it is made anew when it has to hold more of them than ever before, and else
    only told what has changed.

    Args:
        nodes: viser's `SceneApi`.
        model: for its meshes.
    """

    def __init__(self, nodes: Any, model: mujoco.MjModel) -> None:
        self._nodes, self._model = nodes, model
        self._handles: dict[tuple[str, bool], Any] = {}

    def update(self, scene: mujoco.MjvScene, turn: np.ndarray, shift: np.ndarray) -> None:
        """Show what a scene shows now.

        Args:
            scene: of MuJoCo.
            turn: of the world before it is drawn, shape (3, 3).
            shift: of the turned world [m], shape (3,).
        """
        groups: dict[tuple[str, bool], list[Instance]] = {key: [] for key in self._handles}
        for each in instances(scene):
            each = each._replace(position_w=turn @ each.position_w + shift, rotation=turn @ each.rotation)
            groups.setdefault((each.shape, bool(each.rgba[3] < 1.0)), []).append(each)
        for key, members in groups.items():
            self._show(key, members)

    def _show(self, key: tuple[str, bool], members: list[Instance]) -> None:
        handle = self._handles.get(key)
        capacity = 0 if handle is None else len(handle.batched_positions)
        if len(members) > capacity:
            if handle is not None:
                handle.remove()
            self._handles[key] = self._node(key, _columns(members, len(members), key[1]))
            return
        for name, values in _columns(members, capacity, key[1]).items():
            setattr(handle, f"batched_{name}", values)  # sent if it differs

    def _node(self, key: tuple[str, bool], columns: dict[str, np.ndarray]) -> Any:
        shape, clear = key
        vertices, faces = unit_mesh(shape, self._model)
        return self._nodes.add_batched_meshes_simple(
            f"/{shape.replace(' ', '_')}{'_clear' if clear else ''}",
            vertices,
            faces,
            **{f"batched_{name}": values for name, values in columns.items()},
            lod="off",
            cast_shadow=not clear,
            receive_shadow=not clear,
        )


def _columns(members: list[Instance], count: int, clear: bool) -> dict[str, np.ndarray]:
    """What viser wants to know of instances; those beyond the given ones are points that nobody sees."""
    used = len(members)
    positions, scales = np.zeros((count, 3), np.float32), np.zeros((count, 3), np.float32)
    wxyzs = np.tile(np.array([1.0, 0.0, 0.0, 0.0], np.float32), (count, 1))
    colors, opacities = np.zeros((count, 3), np.uint8), np.zeros(count, np.float32)
    if used:
        positions[:used] = [each.position_w for each in members]
        scales[:used] = [each.scale for each in members]
        wxyzs[:used] = [quat_from_matrix(each.rotation) for each in members]
        rgba = np.clip([each.rgba for each in members], 0.0, 1.0)
        rgba[:, :3] *= CLEAR_SHADE if clear else 1.0
        colors[:used], opacities[:used] = np.rint(255.0 * rgba[:, :3]), rgba[:, 3]
    columns: dict[str, np.ndarray] = {"positions": positions, "wxyzs": wxyzs, "scales": scales, "colors": colors}
    return columns | ({"opacities": opacities} if clear else {})
