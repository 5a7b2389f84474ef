"""Errors of physics engines after 30 s of two free rotations: NASA's brick, and a spin near the separatrix.

    PYTHONPATH=. python tests/benchmarks/engines.py --venvs DIR

installs each engine in an environment of its own in DIR (some 4 GB), runs it there, and prints the table of engines.md.
Without --venvs the engines of this environment run (`pip install --group engines`). Each engine is used as its manual
says, with its default settings and with the best that we found for this task; corrections are welcome. An engine that
is not installed, or fails, is a row that says why.
"""

import argparse
import importlib.metadata
import json
import math
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

DURATION = 30.0  # s
RADIAN = 3.141592653589793 / 180
CASES = {  # name → moments of inertia relative to the greatest, angular velocity at the start (rad/s)
    "brick": ([1894220 / 7194665, 6211019 / 7194665, 1.0], [10 * RADIAN, 20 * RADIAN, 30 * RADIAN]),
    "separatrix": ([1 / 3, 2 / 3, 1.0], [0.0009765625, 0.9765625, 0.0]),  # 1 - m = 1e-6
}
TIMEOUT = 300  # s, of one run
PAGE = Path(__file__).with_name("engines.md")


class Row(NamedTuple):
    """A row of the page's table: an engine of a version, with settings."""

    name: str
    version: str
    integrator: str
    label: str  # "default", "best", or empty
    step_text: str  # "10 ms", "1/240 s", or "adaptive"

    @property
    def package(self) -> str:
        """The name of the engine's package."""
        return ENGINES[self.name][0]

    @property
    def step(self) -> float:
        """The step, s; 0 if it is adaptive."""
        if self.step_text == "adaptive":
            return 0.0
        number, unit = self.step_text.split()
        return float(Fraction(number) * (Fraction(1, 1000) if unit == "ms" else 1))


def page_table():
    """Yield the cells of each row of the page's table."""
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        if line.startswith("| ") and not line.startswith("| engine "):
            yield [cell.strip() for cell in line.split("|")[1:-1]]


OLDER = {("drake", "1.30.0"): "numpy<2"}  # built for it; ends with a segmentation fault otherwise


# -- engines: each returns the attitude after DURATION, a quaternion, scalar first


def mujoco(moments, omega, integrator, step):
    """A body with a free joint; the velocity of the joint is in the body's axes."""
    import mujoco

    inertia = " ".join(map(repr, moments))
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco><option timestep="{step}" gravity="0 0 0" integrator="{integrator}"/><worldbody><body><freejoint/>
        <inertial pos="0 0 0" mass="1" diaginertia="{inertia}"/></body></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    data.qvel[3:] = omega
    for _ in range(round(DURATION / step)):
        mujoco.mj_step(model, data)
    return data.qpos[3:7].tolist()


def drake(moments, omega, integrator, step):
    """A floating body in a MultibodyPlant: discrete, or continuous with an integrator of the simulator."""
    from pydrake.multibody.math import SpatialVelocity
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
    from pydrake.multibody.tree import SpatialInertia, UnitInertia
    from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
    from pydrake.systems.framework import DiagramBuilder

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=step)
    body = plant.AddRigidBody("body", SpatialInertia(1.0, [0, 0, 0], UnitInertia(*moments)))
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    plant.Finalize()
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodySpatialVelocity(body, SpatialVelocity(omega, [0, 0, 0]), context)
    if not step:
        config = SimulatorConfig(integration_scheme=integrator.partition(",")[0], accuracy=1e-12, max_step_size=0.01)
        ApplySimulatorConfig(config, simulator)
    simulator.AdvanceTo(DURATION)
    return plant.EvalBodyPoseInWorld(context, body).rotation().ToQuaternion().wxyz().tolist()


def basilisk(moments, omega, integrator, step):
    """A spacecraft without gravity; attitudes are modified Rodrigues parameters of the body relative to space."""
    from Basilisk.simulation import spacecraft
    from Basilisk.utilities import RigidBodyKinematics, SimulationBaseClass, macros

    simulation = SimulationBaseClass.SimBaseClass()
    simulation.CreateNewProcess("process").addTask(simulation.CreateNewTask("task", macros.sec2nano(step)))
    craft = spacecraft.Spacecraft()
    craft.hub.mHub = 1.0
    craft.hub.IHubPntBc_B = [[moments[0], 0, 0], [0, moments[1], 0], [0, 0, moments[2]]]
    craft.hub.omega_BN_BInit = [[x] for x in omega]
    simulation.AddModelToTask("task", craft)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano(DURATION))
    simulation.ExecuteSimulation()
    q = RigidBodyKinematics.MRP2EP(craft.scStateOutMsg.read().sigma_BN)
    return [float(x) for x in q]


def dart(moments, omega, integrator, step):
    """A skeleton with a free joint."""
    import dartpy

    world = dartpy.simulation.World()
    world.setGravity([0, 0, 0])
    world.setTimeStep(step)
    skeleton = dartpy.dynamics.Skeleton()
    _, body = skeleton.createFreeJointAndBodyNodePair()
    inertia = dartpy.dynamics.Inertia()
    inertia.setMass(1.0)
    inertia.setMoment([[moments[0], 0, 0], [0, moments[1], 0], [0, 0, moments[2]]])
    body.setInertia(inertia)
    skeleton.setVelocities([*omega, 0.0, 0.0, 0.0])
    world.addSkeleton(skeleton)
    for _ in range(round(DURATION / step)):
        world.step()
    return quaternion(body.getWorldTransform().rotation())


def pinocchio(moments, omega, integrator, step):
    """A free-flyer joint, the articulated-body algorithm, and its integration on the group of motions."""
    import numpy as np
    import pinocchio as pin

    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "free")
    model.appendBodyToJoint(joint, pin.Inertia(1.0, np.zeros(3), np.diag(moments)), pin.SE3.Identity())
    model.gravity = pin.Motion.Zero()
    data, q, v = model.createData(), pin.neutral(model), np.array([0, 0, 0, *omega])
    for _ in range(round(DURATION / step)):
        v = v + step * pin.aba(model, data, q, v, np.zeros(6))
        q = pin.integrate(model, q, v * step)
    return [q[6], *q[3:6]]


def bullet(moments, omega, integrator, step):
    """A body without a shape."""
    import pybullet

    pybullet.connect(pybullet.DIRECT)
    pybullet.setTimeStep(step)
    body = pybullet.createMultiBody(baseMass=1.0)
    damping = {} if "0.04" in integrator else {"linearDamping": 0.0, "angularDamping": 0.0}
    pybullet.changeDynamics(body, -1, localInertiaDiagonal=moments, **damping)
    pybullet.resetBaseVelocity(body, angularVelocity=omega)
    for _ in range(round(DURATION / step)):
        pybullet.stepSimulation()
    x, y, z, w = pybullet.getBasePositionAndOrientation(body)[1]
    return [w, x, y, z]


def exudyn(moments, omega, integrator, step):
    """A rigid body with Euler parameters."""
    import exudyn
    import numpy as np
    from exudyn.utilities import RigidBodyInertia

    container = exudyn.SystemContainer()
    system = container.AddSystem()
    inertia = RigidBodyInertia(mass=1.0, inertiaTensor=np.diag(moments))
    is_explicit = integrator == "RK44"
    node = exudyn.NodeType.RotationRotationVector if is_explicit else exudyn.NodeType.RotationEulerParameters
    options = {"inertia": inertia, "initialAngularVelocity": omega, "nodeType": node}
    found = system.CreateRigidBody(**options, returnDict=True)
    system.Assemble()
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(DURATION / step)
    settings.timeIntegration.endTime = DURATION
    settings.solutionSettings.writeSolutionToFile = False
    kind = getattr(exudyn.DynamicSolverType, integrator.replace("generalized alpha", "GeneralizedAlpha"))
    system.SolveDynamic(settings, solverType=kind)
    rotation = system.GetObjectOutputBody(found["bodyNumber"], exudyn.OutputVariableType.RotationMatrix, [0, 0, 0])
    return quaternion(np.reshape(rotation, (3, 3)))


def brax(moments, omega, integrator, step):
    """A body with a free joint, in the pipeline that is named; single precision unless JAX is told otherwise."""
    from importlib import import_module

    import jax

    jax.config.update("jax_enable_x64", "double" in integrator)
    from brax.io import mjcf

    pipeline = import_module(f"brax.{integrator.partition(',')[0]}.pipeline")
    inertia = " ".join(map(repr, moments))
    system = mjcf.loads(f"""
        <mujoco><option timestep="{step}" gravity="0 0 0"/><worldbody><body><freejoint/>
        <inertial pos="0 0 0" mass="1" diaginertia="{inertia}"/><geom size="0.1" contype="0" conaffinity="0"/>
        </body></worldbody></mujoco>""")
    velocity = jax.numpy.array([0.0, 0.0, 0.0, *omega])
    state = jax.jit(pipeline.init)(system, system.init_q, velocity)
    advance = jax.jit(lambda state: jax.lax.fori_loop(
        0, round(DURATION / step), lambda _, now: pipeline.step(system, now, jax.numpy.zeros(system.act_size())), state
    ))  # fmt: skip
    return [float(x) for x in advance(state).x.rot[0]]


def newton(moments, omega, integrator, step):
    """A body without a shape, in the solver that is named; Warp has single precision."""
    import newton as engine
    import warp

    builder = engine.ModelBuilder(gravity=(0.0, 0.0, 0.0))
    inertia = warp.mat33(moments[0], 0.0, 0.0, 0.0, moments[1], 0.0, 0.0, 0.0, moments[2])
    body = builder.add_body(mass=1.0, inertia=inertia)
    model = builder.finalize(device="cpu")
    options = {"angular_damping": 0.0} if "no damping" in integrator else {}
    solver = getattr(engine.solvers, integrator.partition(",")[0])(model, **options)
    now, later, control = model.state(), model.state(), model.control()
    velocities = now.body_qd.numpy()
    velocities[body, 3:] = omega
    now.body_qd.assign(velocities)
    for _ in range(round(DURATION / step)):
        now.clear_forces()
        solver.step(now, later, control, None, step)
        now, later = later, now
    x, y, z, w = now.body_q.numpy()[body, 3:]
    return [float(value) for value in (w, x, y, z)]


def quaternion(matrix):
    """Unit quaternion, scalar first, of a rotation matrix."""
    from numpy.linalg import eigh

    (a, b, c), (d, e, f), (g, h, i) = [[float(x) for x in row] for row in matrix]
    rows = [[a + e + i, h - f, c - g, d - b], [h - f, a - e - i, b + d, c + g],
            [c - g, b + d, e - a - i, f + h], [d - b, c + g, f + h, i - a - e]]  # fmt: skip
    return eigh(rows)[1][:, -1].tolist()


ENGINES = {  # name → package, function that returns the attitude
    "MuJoCo": ("mujoco", mujoco),
    "Drake": ("drake", drake),
    "Basilisk": ("bsk", basilisk),
    "Exudyn": ("exudyn", exudyn),
    "DART": ("dartpy", dart),
    "Pinocchio": ("pin", pinocchio),
    "PyBullet": ("pybullet", bullet),
    "Brax": ("brax", brax),
    "Newton": ("newton", newton),
}
ROWS = [Row(*cells[:5]) for cells in page_table() if cells[0] in ENGINES]
NOT_RUN = {cells[0]: cells[5] for cells in page_table() if cells[0] not in ENGINES}  # engine → reason


# -- the table


def run_here(row, case):
    """Attitude of a row, in the environment that has its engine."""
    try:
        found = importlib.metadata.version(row.package)
    except importlib.metadata.PackageNotFoundError:
        raise ImportError(f"{row.package} is not installed") from None
    if found != row.version:
        raise ImportError(f"{found} is installed")
    return ENGINES[row.name][1](*CASES[case], row.integrator, row.step)


def interpreter(row, folder):
    """The Python of the environment of a row, which is made if it is not there."""
    if folder is None:
        return sys.executable
    environment = folder / f"{row.package}-{row.version}"
    python = environment / "bin/python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", environment], check=True)
        packages = [OLDER.get((row.package, row.version), "numpy"), f"{row.package}=={row.version}"]
        subprocess.run([python, "-m", "pip", "install", "-q", *packages], check=False)
    return str(python)


def attitude(row, case, folder):
    """Attitude of a row after DURATION; a RuntimeError says why there is none."""
    command = [interpreter(row, folder), __file__, "--row", str(ROWS.index(row)), "--case", case]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False)
    except subprocess.TimeoutExpired:
        raise RuntimeError(f"takes more than {TIMEOUT} s") from None
    if answer.returncode:
        raise RuntimeError((answer.stderr.strip().splitlines() or ["fails"])[-1][:120])
    return json.loads(answer.stdout.strip().splitlines()[-1])


def error(case, q):
    """Angle between an attitude after DURATION and the exact one, degrees."""
    from scipy.spatial.transform import Rotation

    from kernels.free import exact

    expected = exact.attitude(*CASES[case], [DURATION])[0]
    rotations = (Rotation.from_quat(each, scalar_first=True) for each in (expected, q))
    return math.degrees((next(rotations).inv() * next(rotations)).magnitude())


def cells(row, folder):
    """A line of the table."""
    texts = [*row]
    try:
        texts += [f"{error(case, attitude(row, case, folder)):.3g}" for case in CASES]
    except (RuntimeError, ImportError) as reason:
        texts += [f"not run: {reason}", ""]
    return "| " + " | ".join(texts) + " |"


def main():
    """Run one row and print its attitude, or all rows and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--venvs", type=Path, help="folder of the environments")
    parser.add_argument("--only", default="", help="part of an engine's name")
    parser.add_argument("--row", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--case", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.row is not None:
        print(json.dumps([float(x) for x in run_here(ROWS[args.row], args.case)]))
        return
    print("| engine | version | integrator | settings | step | brick, error in degrees | near the separatrix |")
    print("|---|---|---|---|---|---|---|")
    for row in ROWS:
        if args.only.lower() in row.name.lower():
            print(cells(row, args.venvs), flush=True)
    for name, reason in NOT_RUN.items():
        if args.only.lower() in name.lower():
            print(f"| {name} | | | | | {reason} | |")


if __name__ == "__main__":
    main()
