"""Links of URDF, SDF and MJCF files: one link written in each format, hostile files, and the command."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from calls import refusal_message, run_command

import sweeps
from sweeps.reading.robot_files import read_links
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.bodies.inertia_diagnosis import CAUSES

ROLL, PITCH, YAW = 0.3, -0.7, 1.1
TENSOR = np.array([[0.2, 0.01, -0.02], [0.01, 0.3, 0.03], [-0.02, 0.03, 0.4]])
URDF = """<robot name="r"><link name="frame"/><link name="arm">
  <inertial><origin xyz="0.1 0.2 0.3" rpy="0.3 -0.7 1.1"/><mass value="2.5"/>
    <inertia ixx="0.2" ixy="0.01" ixz="-0.02" iyy="0.3" iyz="0.03" izz="0.4"/></inertial>
  <visual><origin xyz="1 0 0"/><geometry><cylinder radius="0.5" length="3"/></geometry></visual>
  <collision><geometry><mesh filename="%s" scale="2 2 2"/></geometry></collision></link></robot>"""
SDF = """<sdf version="1.11"><model name="r"><link name="arm">
  <inertial><pose>0.1 0.2 0.3 0.3 -0.7 1.1</pose><mass>2.5</mass><inertia><ixx>0.2</ixx><ixy>0.01</ixy><ixz>-0.02</ixz>
    <iyy>0.3</iyy><iyz>0.03</iyz><izz>0.4</izz></inertia></inertial>
  <visual><pose degrees="true">1 0 0 0 0 90</pose><geometry><box><size>1 1 3</size></box></geometry></visual>
  </link></model></sdf>"""
MJCF = """<mujoco><compiler angle="radian"/><worldbody><body name="arm">
  <inertial pos="0.1 0.2 0.3" euler="%s" mass="2.5" fullinertia="0.2 0.3 0.4 0.01 -0.02 0.03"/>
  <geom type="capsule" size="0.5 1" pos="1 0 0"/></body></worldbody></mujoco>"""


def rotation():
    """Rz(yaw) Ry(pitch) Rx(roll), URDF's definition."""
    c, s = np.cos([ROLL, PITCH, YAW]), np.sin([ROLL, PITCH, YAW])
    about_x = np.array([[1, 0, 0], [0, c[0], -s[0]], [0, s[0], c[0]]])
    about_y = np.array([[c[1], 0, s[1]], [0, 1, 0], [-s[1], 0, c[1]]])
    return np.array([[c[2], -s[2], 0], [s[2], c[2], 0], [0, 0, 1]]) @ about_y @ about_x


def written(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    return tmp_path / name


# MuJoCo's small letters rotate about the axes of the body: z, y, x in this order are URDF's angles
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("r.urdf", URDF % "absent.stl"),
        ("r.sdf", SDF),
        ("r.xml", MJCF.replace("radian", 'radian" eulerseq="zyx') % "1.1 -0.7 0.3"),
        ("r.mjcf", MJCF.replace("radian", 'radian" eulerseq="XYZ') % "0.3 -0.7 1.1"),
    ],
    ids=["urdf", "sdf", "rotating angles", "fixed angles"],
)
def test_one_link_in_each_format(tmp_path, name, text):
    (link,) = read_links(written(tmp_path, name, text))
    assert (link.name, link.mass, link.centre.tolist()) == ("arm", 2.5, [0.1, 0.2, 0.3])
    np.testing.assert_array_equal(link.tensor, TENSOR)
    # SciPy's matrices are products of a few roundings
    np.testing.assert_allclose(link.rotation, rotation(), atol=1e-15)
    np.testing.assert_allclose(link.points.min(axis=0), [0.5, -0.5, -1.5], atol=1e-15)
    np.testing.assert_allclose(link.points.max(axis=0), [1.5, 0.5, 1.5], atol=1e-15)


@pytest.mark.parametrize("text", ['quat="1 1 1 1"', 'axisangle="1 1 1 120"'])
def test_a_third_of_a_turn_takes_x_to_y_to_z(tmp_path, text):
    document = MJCF.replace('euler="%s"', text).replace("radian", "degree")
    (link,) = read_links(written(tmp_path, "r.xml", document))
    np.testing.assert_allclose(link.rotation, [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=1e-15)


def test_a_mesh_is_read_below_the_package_alone(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    package = tmp_path / "arm"
    (package / "urdf").mkdir(parents=True)
    for path in (package / "box.stl", tmp_path / "outside.stl"):
        trimesh.creation.box((2.0, 4.0, 6.0)).export(path)
    outside = (
        "package://arm/../outside.stl",
        "../box.stl",
        f"file://{package}/box.stl",
        f"{package}/box.stl",
        "package://",
    )
    for uri in ("package://arm/box.stl", *outside):
        (link,) = read_links(written(package / "urdf", "r.urdf", URDF % uri))
        assert link.points.max() == (1.5 if uri in outside else 6.0), uri


DEFAULTS = """<mujoco><default><geom type="capsule"/><default class="big"><geom size="0.5 1"/></default></default>
  <worldbody><body name="arm" childclass="big">%s<geom pos="1 0 0"/>
    <body name="hand">%s<geom class="main" fromto="0 0 0 1 0 0" size="0.1"/><geom type="sphere" size="0.3"/></body>
    </body>
    <body name="free">%s<geom/></body></worldbody></mujoco>"""


def test_geoms_have_the_defaults_of_their_class_and_of_the_bodies_around_them(tmp_path):
    text = DEFAULTS.replace("%s", '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>')
    arm, hand, free = (link.points for link in read_links(written(tmp_path, "r.xml", text)))
    assert (arm.min(axis=0).tolist(), arm.max(axis=0).tolist()) == ([0.5, -0.5, -1.5], [1.5, 0.5, 1.5])
    assert (hand.min(axis=0).tolist(), hand.max(axis=0).tolist()) == ([-0.3, -0.3, -0.3], [1.1, 0.3, 0.3])
    assert len(free) == 0  # a capsule without a size


def test_the_meshes_of_the_requested_link_alone_are_read(tmp_path, monkeypatch):
    link = re.search('<link name="arm">.*</link>', URDF % "%s.stl", re.DOTALL)[0]
    text = "".join(link.replace("arm", name).replace("%s", name) for name in ("first", "second"))
    paths = []
    monkeypatch.setattr("sweeps.reading.robot_files._mesh_points", lambda path, uri: paths.append(uri))
    (second,) = read_links(written(tmp_path, "r.urdf", f"<robot>{text}</robot>"), "sec")
    assert (second.name, paths) == ("second", ["second.stl"])
    assert second.points.max() == 1.5  # of the visual cylinder: the shapes of collisions are not all known


HEAD = '<!DOCTYPE robot [<!ENTITY e SYSTEM "/etc/passwd"><!ENTITY a "aaaaaaaaaa">]>'


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("r.urdf", HEAD + URDF, "has a document type or an entity"),
        ("r.urdf", URDF.replace("2.5", "&e;"), "is no XML document (undefined entity"),
        ("r.urdf", URDF[:-9], "is no XML document"),
        ("r.urdf", URDF.replace("2.5", "heavy"), "'heavy' is refused; allowed: 1 numbers of at most 1e+30"),
        ("r.urdf", URDF.replace("0.1 0.2 0.3", "0.1 inf 0.3"), "allowed: 3 numbers of at most 1e+30"),
        ("r.urdf", "<robot><xacro:arm/></robot>", "allowed: its expansion: xacro"),
        ("r.urdf", URDF.replace('"0.4"', '"1e308"'), "'1e308' is refused"),
        ("r.urdf", URDF.replace("<inertial>", "<inertiäl>"), "is no XML document (mismatched tag"),
        ("r.urdf.xacro", URDF, "allowed: its expansion: xacro"),
        ("r.xml", MJCF.replace("<worldbody>", '<worldbody><include file="/etc/passwd"/>'), "names another file"),
        ("r.xml", MJCF.replace('euler="%s"', 'zaxis="0 1 0"'), "allowed: quat, euler or axisangle"),
        ("r.xml", MJCF.replace('euler="%s"', 'quat="0 0 0 0"'), "allowed: a URDF, SDF or MJCF"),
        ("r.xml", MJCF.replace("radian", 'radian" eulerseq="abc') % "1 2 3", "allowed: a URDF, SDF or MJCF"),
        ("r.sdf", SDF.replace("<pose>", '<pose relative_to="base">'), "is relative to another frame"),
        ("r.sdf", "<sdf><model><include><uri>model://x</uri></include></model></sdf>", "names another file"),
        ("r.xml", "<html/>", "has no link with an inertial element"),
        ("r.urdf", "<a>" * 100_000, "is"),
        ("r.urdf", "", "is no XML document"),
    ],
)
def test_hostile_and_damaged_files_are_refused(tmp_path, name, text, words):
    with pytest.raises(DefinitionError) as error:
        read_links(written(tmp_path, name, text))
    assert words in str(error.value)
    assert "; allowed: " in str(error.value)
    assert str(error.value).isprintable()


def test_files_that_are_none_are_refused(tmp_path):
    for path in (tmp_path / "absent.urdf", tmp_path):
        with pytest.raises(DefinitionError, match="allowed: a URDF"):
            read_links(path)


LINKS = """<robot name="r">
<link name="sound"><inertial><mass value="12"/><inertia ixx="5" iyy="10" izz="13"/></inertial></link>
<link name="wrong"><inertial><mass value="1.5"/><inertia ixx="2.6e-3" iyy="2.3e-3" izz="1.6"/></inertial></link>
</robot>"""


def test_the_command_answers_for_one_link_and_for_all(tmp_path, capsys):
    path = written(tmp_path, "r.urdf", LINKS)
    out = run_command(capsys, "body", path, "-o", tmp_path / "links.yaml")
    assert "sound: Spin about axis 3" in out
    assert "wrong: No rigid body has this tensor of inertia. Possible cause: power_of_ten." in out
    facts = json.loads(run_command(capsys, "body", path, "--json"))["bodies"]
    assert facts["sound"]["verdict"]["word"] == "stable"
    assert facts["wrong"]["diagnosis"]["causes"][0]["repair"] == "izz times 1e-3 is 0.0016"
    assert json.loads(run_command(capsys, "body", path, "--link", "sound", "--json"))["moments"] == [5.0, 10.0, 13.0]
    message = refusal_message(capsys, "body", path, "--link", "wrong")
    assert "power_of_ten (100 %)" in message
    checked = json.loads(run_command(capsys, "check", tmp_path / "links.yaml", "--json"))
    assert list(checked["bodies"]) == ["sound"]
    names = ["a" * 90 + str(number) for number in range(4)]  # longer together than a title may be
    link = re.search('<link name="sound">.*</link>', LINKS)[0]
    many = "".join(link.replace("sound", name) for name in names)
    run_command(capsys, "body", written(tmp_path, "r.urdf", f"<robot>{many}</robot>"), "-o", tmp_path / "links.yaml")
    assert list(json.loads(run_command(capsys, "check", tmp_path / "links.yaml", "--json"))["bodies"]) == names


def test_the_handbooks_robot_gives_the_printed_lines(tmp_path, capsys):
    page = (Path(sweeps.__file__).parent / "handbook/text/howto/robots.md").read_text(encoding="utf-8")
    path = written(tmp_path, "arm.urdf", re.search(r"```xml\n(.*?)```", page, re.DOTALL)[1])
    lines = re.search(r"```text\n(.*?)```", page, re.DOTALL)[1].splitlines()
    assert lines == refusal_message(capsys, "body", path, "--link", "forearm").splitlines()[1:]
    assert run_command(capsys, "body", path, "--link", "base")
    assert all(f"| `{cause}` |" in page for cause in CAUSES)
