"""MaterialX validates what we export, knows every node and input, and makes shaders."""

from __future__ import annotations

import numpy as np
import pytest
from made_up import SPECTRAL, result_of

from fitting.export import export
from fitting.export.channels import as_fitted
from fitting.export.materialx_nodes import graph_of
from fitting.export.parts import parts_of
from fitting.export.surface import surface_of

ALBEDO = [0.7, 0.3, 0.05]


@pytest.fixture(scope="module")
def mx():
    return pytest.importorskip("MaterialX", reason="MaterialX is not installed")


@pytest.fixture(scope="module")
def library(mx):
    found = mx.createDocument()
    folders, path = mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath()
    mx.loadLibraries(folders, path, found)
    return found


def loaded(mx, library, path):
    """The document, valid and with known nodes, inputs and types."""
    document = mx.createDocument()
    mx.readFromXmlFile(document, str(path))
    document.setDataLibrary(library)
    good, message = document.validate()
    assert good, message
    for node in document.getNodes():
        definition = node.getNodeDef()
        assert definition is not None, node.getName()
        known = {i.getName(): i.getType() for i in definition.getActiveInputs()}
        for own in node.getInputs():
            assert known[own.getName()] == own.getType(), own.getName()
    return document


def numbers(node, name: str) -> np.ndarray:
    return np.array([float(v) for v in node.getInput(name).getValueString().split(",")])


def shader_of(mx, document):
    """The GLSL that MaterialX itself makes of the material."""
    from MaterialX import PyMaterialXGenGlsl, PyMaterialXGenShader

    whole = mx.createDocument()
    folders, path = mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath()
    mx.loadLibraries(folders, path, whole)
    whole.importLibrary(document)
    (material,) = whole.getMaterialNodes()
    generator = PyMaterialXGenGlsl.GlslShaderGenerator.create()
    context = PyMaterialXGenShader.GenContext(generator)
    context.registerSourceCodeSearchPath(path)
    return generator.generate("material", material, context)


def test_a_sum_of_lobes_is_a_graph(mx, library, tmp_path):
    result = result_of(
        "lambert + ggx(aniso) + ggx(f82, retro) + ggx(conductor) + eon + oren_nayar",
        lambert__albedo=ALBEDO, ggx1__alpha_x=0.1, ggx1__alpha_y=0.4,
        ggx1__f0=[0.03, 0.04, 0.05],
        ggx2__tint=0.5, ggx3__k=[2.0], ggx3__scale=0.7, eon__roughness=0.6,
    )  # fmt: skip
    report = export(result, "materialx", tmp_path / "red paint 1.mtlx")
    assert report.exact
    document = loaded(mx, library, tmp_path / "red paint 1.mtlx")
    by_kind = {}
    for node in document.getNodes():
        by_kind.setdefault(node.getCategory(), []).append(node)
    schlick, tinted = by_kind["generalized_schlick_bsdf"]
    np.testing.assert_allclose(numbers(schlick, "roughness"), [0.1, 0.4])
    np.testing.assert_allclose(numbers(schlick, "color0"), [0.03, 0.04, 0.05])
    assert tinted.getInputValue("retroreflective") is True
    np.testing.assert_allclose(numbers(tinted, "color82"), 0.5)
    np.testing.assert_allclose(numbers(by_kind["conductor_bsdf"][0], "extinction"), 2.0)
    np.testing.assert_allclose(numbers(by_kind["multiply"][0], "in2"), 0.7)
    lambert, eon, rough = by_kind["oren_nayar_diffuse_bsdf"]
    np.testing.assert_allclose(numbers(lambert, "color"), ALBEDO)
    assert eon.getInputValue("energy_compensation") is True
    assert rough.getInputValue("energy_compensation") is False
    # Every lobe is part of the sum.
    assert len(by_kind["add"]) == 5


def test_makes_a_shader(mx, library, tmp_path):
    result = result_of("lambert + ggx", SPECTRAL)
    export(result, "materialx", tmp_path / "a.mtlx")
    document = loaded(mx, library, tmp_path / "a.mtlx")
    source = shader_of(mx, document).getSourceCode("pixel")
    assert "mx_generalized_schlick_bsdf" in source
    assert "mx_oren_nayar_diffuse_bsdf" in source


def test_openpbr_is_written_as_it_is(mx, library, tmp_path):
    result = result_of(
        "openpbr", openpbr__base_color=ALBEDO, openpbr__specular_roughness=0.4,
        openpbr__specular_ior=1.6,
    )  # fmt: skip
    report = export(result, "openpbr", tmp_path / "a.mtlx")
    assert report.exact
    document = loaded(mx, library, tmp_path / "a.mtlx")
    (surface,) = [n for n in document.getNodes() if n.getCategory() == "open_pbr_surface"]
    np.testing.assert_allclose(numbers(surface, "base_color"), ALBEDO)
    assert surface.getInputValue("specular_roughness") == pytest.approx(0.4)
    assert surface.getInputValue("specular_ior") == pytest.approx(1.6)
    assert "specular_roughness is the root" in (tmp_path / "a.mtlx").read_text()


@pytest.mark.full
def test_openpbr_is_refitted(mx, library, tmp_path):
    """A glossy paint: near, for what OpenPBR's base is made for."""
    result = result_of("lambert + ggx", lambert__albedo=ALBEDO, ggx__f0=0.04, ggx__f90=1.0)
    report = export(result, "openpbr", tmp_path / "a.mtlx")
    assert any("refitted" in r for r in report.remarks)
    assert report.residual.relative_rms < 0.2
    assert str(report.residual) in (tmp_path / "a.mtlx").read_text()
    document = loaded(mx, library, tmp_path / "a.mtlx")
    (surface,) = [n for n in document.getNodes() if n.getCategory() == "open_pbr_surface"]
    assert surface.getInputValue("specular_roughness") == pytest.approx(0.2**0.5, rel=0.1)
    assert surface.getInputValue("specular_ior") == pytest.approx(1.5, rel=0.1)


def test_what_has_no_node_is_named():
    result = result_of("lambert + beckmann")
    surface = surface_of(result, as_fitted(result.channels))
    assert graph_of(parts_of(surface)[0]) == "MaterialX has no node for beckmann"
