"""Scenes of Sionna RT: surfaces out of rectangles, one access point and devices with the same antennas, one thread."""

import mitsuba as mi
import drjit as dr
import numpy as np
import sionna.rt as rt

LIGHT_M_S = 299_792_458.0

dr.set_thread_count(0)  # The thread that calls does all the work.


def scene_of(frequency_hz, rectangles_m):
    """Of rectangles of metal, each four corners in turn."""
    material = rt.RadioMaterial("metal", thickness=0.001, relative_permittivity=1.0, conductivity=1e7)
    scene = rt.load_scene()
    scene.frequency = frequency_hz
    surface = []
    for number, corners_m in enumerate(rectangles_m):
        mesh = mi.Mesh(f"surface-{number}", 4, 2)
        values = mi.traverse(mesh)
        values["vertex_positions"] = np.asarray(corners_m, dtype=np.float32).ravel()
        values["faces"] = np.array([0, 1, 2, 0, 2, 3], dtype=np.uint32)
        values.update()
        surface.append(rt.SceneObject(mi_mesh=mesh, name=f"surface-{number}", radio_material=material))
    scene.edit(add=surface)
    scene.tx_array = rt.PlanarArray(num_rows=1, num_cols=1, pattern="iso", polarization="V")
    scene.rx_array = scene.tx_array
    return scene


def place(scene, access_points_m, devices_m):
    for number, at_m in enumerate(access_points_m):
        scene.add(rt.Transmitter(f"ap-{number}", position=at_m.tolist()))
    for number, at_m in enumerate(devices_m):
        scene.add(rt.Receiver(f"ue-{number}", position=at_m.tolist()))


def fields(paths, devices, access_points):
    """Of each path its amplitude and delay in s, by device and access point; a path that is none has neither."""
    real, imaginary = (part.numpy() for part in paths.a)
    tau_s, valid = paths.tau.numpy(), paths.valid.numpy()
    shape = (devices, access_points, -1)
    return np.reshape(real + 1j * imaginary, shape), np.reshape(tau_s, shape), np.reshape(valid, shape)
