#!/usr/bin/python3
"""fusion_peers.py FOLDER VOXEL_MM ROUNDS: Open3D on the files of bench_fusion; figures as JSON on standard output.

Its two volumes fuse the range images that this project integrates, at the same places, into scalable.ply and blocks.ply
of FOLDER; its global registration with ICP finds the motion between the poses. Debian's Open3D belongs to Debian's
Python, so this is a program of its own.
"""
import json
import pathlib
import statistics
import sys
import time

import numpy as np
import open3d as o3d

SEED = 1
BAND_VOXELS = 3.0  # as this project's band
FAR_MM = 2000.0
CLOUD_MM, FINE_MM = 1.5, 0.5  # spacing of the points that are searched with, and of those that ICP aligns
ICP_MM = (1.0, 0.4)  # its reach, round by round


def views_of(folder):
    made = json.loads((folder / "views.json").read_text())
    for view in made["views"]:
        shape = (view["height"], view["width"])
        view["depth"] = np.fromfile(folder / view["file"], np.float32).reshape(shape)
        view["flat"] = np.nan_to_num(view["depth"], nan=0.0)
        # VoxelBlockGrid cuts a pixel's position off where it would have to be rounded; without this half pixel its
        # median error is 2.5 times as large.
        view["k"] = np.array([[view["fx"], 0, view["cx"] + 0.5], [0, view["fy"], view["cy"] + 0.5], [0, 0, 1.0]])
        view["from_model"] = np.array(view["camera_from_model"])
        view["from_pose"] = np.array(view["camera_from_pose"])
    return made


def timed(work, rounds):
    """Median seconds, those of the processor, and the last result."""
    wall, processor = [], []
    for _ in range(rounds):
        begun, used = time.monotonic(), time.process_time()
        made = work()
        wall.append(time.monotonic() - begun)
        processor.append(time.process_time() - used)
    return [statistics.median(wall), statistics.median(processor)], made


def by_scalable(views, voxel_mm):
    """ScalableTSDFVolume; it takes an image of colour with every one of depth."""
    kind = o3d.pipelines.integration
    images = []
    for view in views:
        height, width = view["flat"].shape
        grey = o3d.geometry.Image(np.zeros((height, width, 3), np.uint8))
        pair = o3d.geometry.RGBDImage.create_from_color_and_depth(
            grey, o3d.geometry.Image(view["flat"]), depth_scale=1.0, depth_trunc=FAR_MM, convert_rgb_to_intensity=False)
        lens = o3d.camera.PinholeCameraIntrinsic(width, height, view["fx"], view["fy"], view["cx"], view["cy"])
        images.append((pair, lens, view["from_model"]))

    def fuse():
        volume = kind.ScalableTSDFVolume(voxel_mm, BAND_VOXELS * voxel_mm, kind.TSDFVolumeColorType.NoColor)
        for pair, lens, place in images:
            volume.integrate(pair, lens, place)
        return volume.extract_triangle_mesh()

    return fuse


def by_blocks(views, voxel_mm):
    """VoxelBlockGrid, as its example integrates: the blocks that a view touches, then its depth."""
    core = o3d.core
    images = [(o3d.t.geometry.Image(core.Tensor(np.ascontiguousarray(view["flat"]))), core.Tensor(view["k"]),
               core.Tensor(view["from_model"])) for view in views]

    def fuse():
        grid = o3d.t.geometry.VoxelBlockGrid(("tsdf", "weight"), (core.float32, core.float32), ((1,), (1,)), voxel_mm,
                                             16, 20000, core.Device("CPU:0"))
        for depth, lens, place in images:
            near = grid.compute_unique_block_coordinates(depth, lens, place, 1.0, FAR_MM, BAND_VOXELS)
            grid.integrate(near, depth, lens, place, 1.0, FAR_MM, BAND_VOXELS)
        return grid.extract_triangle_mesh(weight_threshold=0.0).to_legacy()

    return fuse


def cloud_of(views, pose):
    """What the views of a pose measured, in its frame."""
    parts = []
    for view in views:
        if view["pose"] == pose:
            v, u = np.nonzero(np.isfinite(view["depth"]))
            z = view["depth"][v, u].astype(np.float64)
            there = np.stack([(u - view["cx"]) / view["fx"] * z, (v - view["cy"]) / view["fy"] * z, z], axis=1)
            turn, shift = view["from_pose"][:3, :3], view["from_pose"][:3, 3]
            parts.append((there - shift) @ turn)
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.concatenate(parts)))


def with_normals(cloud, spacing_mm):
    small = cloud.voxel_down_sample(spacing_mm)
    small.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(2 * spacing_mm, 30))
    centre = small.get_center()
    small.orient_normals_towards_camera_location(centre)
    small.normals = o3d.utility.Vector3dVector(-np.asarray(small.normals))
    return small


def motion_by_features(first, second):
    """Fast global registration of FPFH features, then ICP to planes: pose1_from_pose2."""
    registration = o3d.pipelines.registration
    o3d.utility.random.seed(SEED)
    coarse = [with_normals(cloud, CLOUD_MM) for cloud in (first, second)]
    features = [registration.compute_fpfh_feature(cloud, o3d.geometry.KDTreeSearchParamHybrid(5 * CLOUD_MM, 100))
                for cloud in coarse]
    option = registration.FastGlobalRegistrationOption(maximum_correspondence_distance=CLOUD_MM, iteration_number=64)
    motion = registration.registration_fgr_based_on_feature_matching(coarse[1], coarse[0], features[1], features[0],
                                                                     option).transformation
    fine = [with_normals(cloud, FINE_MM) for cloud in (first, second)]
    for reach in ICP_MM:
        motion = registration.registration_icp(
            fine[1], fine[0], reach, motion, registration.TransformationEstimationPointToPlane()).transformation
    return motion


def motion_error(motion, truth, centre):
    """Degrees, and mm at the object's centre."""
    turn = motion[:3, :3] @ truth[:3, :3].T
    degrees = np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)))
    at = np.append(centre, 1.0)
    return {"deg": float(degrees), "mm": float(np.linalg.norm((motion @ at - truth @ at)[:3]))}


def motions(made, rounds):
    first, second = (cloud_of(made["views"], pose) for pose in (1, 2))
    truth, centre = np.array(made["true_pose1_from_pose2"]), second.get_center()
    seconds, motion = timed(lambda: motion_by_features(first, second), rounds)
    return seconds, {"own": motion_error(np.array(made["pose1_from_pose2"]), truth, centre),
                     "features": motion_error(motion, truth, centre)}


def main():
    folder, voxel_mm, rounds = pathlib.Path(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3])
    made = views_of(folder)
    found = {"version": o3d.__version__, "fusion_seconds": {}}
    for name, prepare in (("scalable", by_scalable), ("blocks", by_blocks)):
        found["fusion_seconds"][name], mesh = timed(prepare(made["views"], voxel_mm), rounds)
        o3d.io.write_triangle_mesh(str(folder / f"{name}.ply"), mesh)
    found["features_seconds"], found["motions"] = motions(made, rounds)
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
