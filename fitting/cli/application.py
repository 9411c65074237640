"""The commands by name; their modules are imported when they are called."""

from __future__ import annotations

from importlib.metadata import version

from cyclopts import App

_COMMANDS = {
    "fit": "Fit models to measured reflectance or transmittance and judge the result.",
    "batch": "Fit many files, each for itself, by many processes or machines.",
    "texels": "Fit every texel of a spatially varying sample, a million in minutes.",
    "info": "Say what is in a file: geometry, coverage, values, quality.",
    "score": "Measure a fit result against a file, without fitting.",
    "reflectance": "Reflectances, transmittances and colours of a fit or of a file.",
    "tradeoff": "Measure speed against accuracy: of models, and of choices inside one.",
    "choose": "Keep the cheapest model that a scene cannot tell from the data.",
    "plot": "Draw figures of a fit: slices, lobes, residuals, albedo, spectra, ...",
    "view": "Write a web page to play with fits: lobe, lit sphere, slices, sliders.",
    "report": "Write a fit as one HTML file: verdict, figures, parameters, how to cite.",
    "convert": "Write measurements in another format.",
    "export": "Write a fit for a renderer, an optical design program, or as a table.",
    "models": "List the models, or describe one in full.",
    "formats": "List the file formats, or describe one in full.",
    "scene": "List the scenes that a model may be good enough for, or explain one.",
    "stress": "Put lobes to the test: contracts, and rounding errors against 50 digits.",
    "doctor": "Check that the installation works.",
}

_CODES = "Exit codes: 0 good, 1 the fit did not converge, 2 usage, 3 unreadable input.\n"

_EPILOGUE = f"""\
Begin with `brdf fit`, which fits the bundled sample, or `brdf fit FILE`.
Every command explains itself: `brdf fit --help`.

{_CODES}"""


_EXAMPLES = {
    "fit": """\
Examples:
  brdf fit                                  the bundled sample
  brdf fit paint.astm                       some common models compared
  brdf fit paint.astm -m 'lambert + ggx'    one model
  brdf fit paint.astm -m 'eon + ggx' --fix ggx.f90=1 --max-theta 75
  brdf fit foil_r.astm foil_t.astm          reflection and transmission together
  brdf fit paint.astm --json > paint.json   for programs
""",
    "batch": """\
Examples:
  brdf batch 'data/*.astm' -o results/            every file by itself, a process per core
  brdf batch 'data/*.astm' -o results/ --resume   goes on, however it was ended
  brdf batch 'data/**/*.csv' -m 'lambert + ggx' --no-cv --workers 8
  brdf batch 'data/*.astm' --scheduler local      dask on this machine
  brdf batch 'data/*.astm' --scheduler tcp://login1:8786

The last one uses a dask scheduler that runs, whose workers see the same files; under Slurm:

  from dask_jobqueue import SLURMCluster
  cluster = SLURMCluster(cores=16, processes=16, memory="32GB", walltime="02:00:00")
  cluster.scale(jobs=8)
  print(cluster.scheduler_address)                # for --scheduler
  input("Enter ends it: ")

Exit code 1 of this command: a file failed, or its fit did not converge.
""",
    "texels": """\
Examples:
  brdf texels wood.h5 -m 'lambert + ggx' -o wood.texels.h5
  brdf texels wood.h5 --workers 2                 processes share the chunks
  brdf texels wood.h5 --resume                    goes on, however it was ended
  brdf texels wood.h5 --fix ggx.f90=1 --bounds ggx.alpha=0.02:0.8

FILE is HDF5: theta_i, phi_i, theta_r, phi_r (n), with the attribute units =
'rad' or 'deg', and value (t, n, c) or (h, w, n, c): texels, directions,
channels; BSDF in 1/sr without cosine, NaN where unknown. Optional: valid and
sigma like value, channel (c), wavelength (c) in nm. From arrays, with h5py:

  with h5py.File("wood.h5", "w") as file:
      for name, angle in directions.items():
          file[name] = angle
          file[name].attrs["units"] = "deg"
      file["value"] = values

The result holds parameters/NAME and uncertainties/NAME, (t) or (t, c), and cost,
converged, steps, used, runner_up (t). Data are read in chunks: memory does not
grow with the file.

Exit code 1 of this command: no texel converged, or it did not come to its end.
""",
    "info": "Example: brdf info paint.astm\n",
    "score": "Example: brdf score other_sample.astm paint.fit.json\n",
    "reflectance": """\
Examples:
  brdf reflectance paint.fit.json                         the usual geometries
  brdf reflectance paint.fit.json -g 8/d -g '8/d SCE' --illuminant A --observer 10
  brdf reflectance paint.fit.json -g black-sky --theta 30
  brdf reflectance opal.fit.json -g 'T 0/d' --from back
  brdf reflectance paint.fit.json --cone 45:0:5,0:0:10    two cones of your own
  brdf reflectance paint.fit.json -g 45/0 --reference before.fit.json
  brdf reflectance paint.astm -g 8/d                      the data, without a model
""",
    "tradeoff": """\
Examples:
  brdf tradeoff                                       the bundled sample, some minutes
  brdf tradeoff paint.astm -o paint.tradeoff.json --figure paint.pdf
  brdf tradeoff paint.astm -m lambert -m 'lambert + ggx' --inside none
  brdf tradeoff paint.astm --quick --cost fit --error albedo
""",
    "choose": """\
Examples:
  brdf choose                                   the bundled sample in a studio
  brdf choose paint.astm --scene overcast       the fit goes to paint.overcast.fit.json
  brdf choose paint.astm --scene mine.toml -m lambert -m 'lambert + ggx'
  brdf choose paint.astm --scene sun --json > paint.sun.json

A scene of your own: brdf scene studio --write mine.toml, then change it.
Exit code 1 of this command: no candidate is within the tolerance.
""",
    "view": """\
Examples:
  brdf view paint.fit.json                    the page paint.view.html
  brdf view paint.fit.json --open             and a browser that shows it
  brdf view ggx.fit.json ward.fit.json        two fits side by side
  brdf view paint.fit.json --data moved/paint.astm -o paint.html
""",
    "plot": """\
Examples:
  brdf plot --list                            what there is
  brdf plot paint.fit.json                    all, as paint.FIGURE.png
  brdf plot paint.fit.json slices beta -o figures --format svg
  brdf plot paint.fit.json slices --channel '450 nm' -o slices.pdf
  brdf plot paint.fit.json -o paint.pdf       all, a page each
  brdf plot paint.fit.json --data moved/paint.astm
""",
    "report": """\
Examples:
  brdf report paint.fit.json                       paint.report.html
  brdf report paint.fit.json other.fit.json        compared with another fit
  brdf report paint.fit.json --data moved/paint.astm -o reports
""",
    "convert": "Example: brdf convert paint.astm paint.csv\n",
    "export": """\
Examples:
  brdf export                                    the targets
  brdf export paint.fit.json --to mitsuba        writes paint.xml
  brdf export paint.fit.json --to mitsuba --as principled -o p.xml
  brdf export paint.fit.json --to pbrt --spectral
  brdf export paint.fit.json --to zemax --channels 550nm
  brdf export paint.fit.json --to csv --theta-i 0:60:15 --theta-r 0:80:1
  brdf export paint.fit.json --to gltf --json    what it says, for programs
""",
    "models": "Examples: brdf models; brdf models ggx\n",
    "formats": "Examples: brdf formats; brdf formats csv\n",
    "scene": """\
Examples:
  brdf scene                              the presets
  brdf scene sun                          one of them, explained
  brdf scene studio --write mine.toml     a copy to change, with comments
  brdf scene mine.toml                    a scene of your own
  brdf scene --fields                     everything that may stand in one
""",
    "stress": """\
Examples:
  brdf stress                     every lobe with every option, some minutes
  brdf stress 'ggx(aniso)'        one of them, at more points
  brdf stress ggx --options       one with all its options
  brdf stress my_lobe.py          a lobe of your own

Exit code 1 of this command: a contract fails.
""",
    "doctor": "",
}


def application() -> App:
    """The command line as a cyclopts application."""
    app = App(
        name="brdf",
        help="Fit parametric reflectance models to goniometer files, with honest errors.",
        help_epilogue=_EPILOGUE,
        version=lambda: f"brdf {version('brdf-fitting')}",
        help_format="plaintext",
        suppress_keyboard_interrupt=False,
    )
    for order, (name, text) in enumerate(_COMMANDS.items()):
        app.command(
            f"fitting.cli.{name}:{name}",
            name=name,
            help=text,
            help_epilogue=_EXAMPLES[name] + _CODES,
            sort_key=order,
        )
    return app
