# make demo: the node refines a recorded drive, live. make test: every test. Each sets itself up.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

PINS := .venv-pins
NEWEST := .venv-newest
# what the two commands need; `make pins` pins every extra, for each Python from 3.10 on
EXTRAS := ros,plot,survey,bench,cluster,test
COLCON := colcon-ros colcon-output colcon-test-result
INSTALL := -m pip install --quiet --disable-pip-version-check
# of what builds a package, too, which --constraint would not hold
PINNED := PIP_CONSTRAINT=constraints.txt PIP_BUILD_CONSTRAINT=constraints.txt

# two workers, each of which keeps to a file, in the order of conftest.py; no loadgroup: with pytest 9.2,
# xdist 3.8 deals out each test alone, and what a module shares is made in both workers
TEST := -m pytest -n 2 --dist loadfile --no-loadscope-reorder

# OpenBLAS by its kernels, NumPy by what it dispatches to, numba by its target
KERNELS := prescott $(if $(shell grep -m1 -ow avx2 /proc/cpuinfo),haswell zen) \
	$(if $(shell grep -m1 -ow avx512vl /proc/cpuinfo),skylakex)
PORTABLE := $(KERNELS:%=openblas-%) numpy-without-avx512 numpy-without-avx2 numba-generic
# left out there: what is only read, written, shown or started, and what measures time and memory
PLAIN := atomic_* bad_recordings bench_commands bench_evaluation bench_report_cost bench_speed cluster cloud_f* clouds_again command_* comparison console core_names \
	dead_ports diagnostics documentation experiment_models figures fuzz* gate guesses interface interrupts* jit \
	kernel_cache kitti_segments last_result launch live_run loopback main *_file *_folder messages node_* \
	one_recording options overall pairing* parameters play* pointcloud2 printable rates record_text recorded_truth \
	recording_* report* result* selection settings spool stamps structured_text summary \
	targets text_table traffic transform_* truths worker* worst_frames
DISPATCHED = $(shell $(BIN)/python -c \
	'from numpy._core._multiarray_umath import __cpu_dispatch__; print(*__cpu_dispatch__)')

SITE := .venv-site
INSTALLED := .venv-installed
INSTALLED_BIN := $(INSTALLED)/bin
AARCH64 := manylinux2014 manylinux_2_24 manylinux_2_27 manylinux_2_28
CHECK := $(INSTALLED_BIN)/python -m pytest -q test/check_installation.py

.PHONY: demo test portable newest matrix coverage pins lint docs gallery bench wheel aarch64 FORCE colcon soak test-ros fuzz site three clean help $(PORTABLE)

help:
	@echo 'make demo    start the node, play bags/demo.mcap to it and show each refined transform'
	@echo 'make test    run the tests'
	@echo 'make portable  run the tests that compute as other processors would compute them'
	@echo 'make matrix  lint and test with each Python from 3.10 to 3.13 that is installed'
	@echo 'make coverage  which lines of the core its tests run, the kernels as plain Python'
	@echo 'make newest  run the tests with the newest release of everything, and say what that is'
	@echo 'make pins    pin the newest release of everything in constraints.txt'
	@echo 'make lint    check style, types (of the core strictly), and that imports run one way'
	@echo 'make docs    write the tables and the picture of the documents again'
	@echo 'make gallery  draw the pictures of docs/gallery.md again'
	@echo 'make site    build the documents as a site in build/site, with the Python reference'
	@echo 'make three   bundle three.js for `idem show` again'
	@echo 'make bench   measure accuracy and time'
	@echo 'make wheel   build an sdist and a wheel, install each into an environment of its own, check what it installed'
	@echo 'make aarch64  fetch the wheels of all that is pinned for a 64-bit ARM; fails where one has none'
	@echo 'make colcon  build, check and test with colcon; ARGS="-k worker" goes to pytest'
	@echo 'make test-ros  run the tests of launch and tf on an installed ROS 2 (docs/ros_tests.md)'
	@echo 'make soak    hold the node to a working day: ten minutes of large clouds, overload, faults'
	@echo 'make fuzz    10 000 spoilt clouds, recordings, results, maps and so on each; Ctrl-C 50 times a command'
	@echo 'make clean   remove the virtual environments and what was built'

demo: $(READY)
	$(BIN)/idem demo

test: $(READY)
	ROS_PYTHON_CHECK_FIELDS=1 $(BIN)/python $(TEST) --durations=15 $(ARGS)

portable: $(READY)
	@$(MAKE) -j1 --no-print-directory --keep-going $(PORTABLE)

openblas-prescott: export OPENBLAS_CORETYPE = Prescott
openblas-haswell: export OPENBLAS_CORETYPE = Haswell
openblas-zen: export OPENBLAS_CORETYPE = Zen
openblas-skylakex: export OPENBLAS_CORETYPE = SkylakeX
numpy-without-avx512: export NPY_DISABLE_CPU_FEATURES = $(filter AVX512% X86_V4,$(DISPATCHED))
numpy-without-avx2: export NPY_DISABLE_CPU_FEATURES = $(DISPATCHED)
numba-generic: export NUMBA_CPU_NAME = generic
numba-generic: export NUMBA_CPU_FEATURES =

$(PORTABLE): $(READY)
	@echo '== $@'
	@$(BIN)/python $(TEST) -q -m 'not live' $(PLAIN:%=--ignore-glob='*/test_%.py') $(ARGS) \
		|| { echo '== $@ FAILED'; exit 1; }

# names what differs from the pins first: whatever fails then is due to one of these
newest: $(READY)
	$(PYTHON) -m venv --clear $(NEWEST)
	$(NEWEST)/bin/python $(INSTALL) --editable '.[$(EXTRAS)]'
	@for each in $(VENV) $(NEWEST); do \
		$$each/bin/python -m pip freeze --exclude-editable > $$each/versions.txt; done
	@echo 'pinned (<), newest (>):'
	@diff $(VENV)/versions.txt $(NEWEST)/versions.txt | grep '^[<>]' || echo 'the same'
	ROS_PYTHON_CHECK_FIELDS=1 $(NEWEST)/bin/python $(TEST) $(ARGS)

# the interpreter on the path, or that of pyenv; each has an environment of its own
matrix:
	@failed=; for version in 3.10 3.11 3.12 3.13; do \
		for python in python$$version $${PYENV_ROOT:-$$HOME/.pyenv}/versions/$$version.*/bin/python none; do \
			$$python -c '' 2>/dev/null && break; done; \
		echo "== Python $$version: $$python"; \
		[ $$python = none ] || $(MAKE) --no-print-directory PYTHON=$$python VENV=.venv-$$version \
			lint test || failed="$$failed $$version"; \
	done; [ -z "$$failed" ] || { echo "== failed with Python$$failed"; exit 1; }

COVERED := test/core/geometry test/core/metric/test_kernels.py test/core/metric/test_displacement.py \
	test/core/metric/test_landscape.py test/core/metric/test_noise.py \
	--deselect test/core/metric/test_noise.py::test_a_noisy_pair_is_registered_over_wider_balls \
	test/core/solve test/core/test_config.py test/core/test_retry.py test/core/maps/test_map_blocks.py \
	'test/core/test_registration.py::test_recovers_a_known_transform_from_a_perturbed_start[0-None]'

# compiled, a kernel is one line to coverage; as plain Python most tests would take hours
coverage: $(READY)
	$(BIN)/python $(INSTALL) --constraint constraints.txt pytest-cov
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m pytest -q -W 'ignore:overflow encountered' \
		--cov=idem_ros.core --cov-report=term-missing:skip-covered $(COVERED) $(ARGS)

pins:
	$(PYTHON) -m venv $(PINS)
	$(PINS)/bin/python $(INSTALL) --upgrade uv
	printf '%s\n' $(COLCON) build | $(PINS)/bin/uv pip compile --quiet --upgrade --universal \
		--python-version 3.10 --all-extras --no-annotate --no-header \
		--output-file constraints.txt setup.py -

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/basedpyright --pythonpath $(BIN)/python
	$(BIN)/basedpyright --pythonpath $(BIN)/python --project pyright-basic.json
	$(BIN)/lint-imports

docs: $(READY)
	$(BIN)/python -m benchmarks docs

gallery: $(READY)
	$(BIN)/python -m benchmarks gallery

# read from the source: neither the package nor what it stands on is installed for it
site: $(SITE)/.ready
	NO_MKDOCS_2_WARNING=1 $(SITE)/bin/mkdocs build --quiet

$(SITE)/.ready: setup.py constraints.txt
	$(PYTHON) -m venv $(SITE)
	$(SITE)/bin/python $(INSTALL) --constraint constraints.txt mkdocs-material 'mkdocstrings[python]'
	@touch $@

# needs npm; what it writes is committed, so that nobody else does
three:
	npm install --silent --no-save --prefix build/three three@0.187.0 esbuild
	cp idem_ros/viewer/three_entry.js build/three/
	cd build/three && npx esbuild three_entry.js --bundle --minify --format=iife --global-name=THREE \
		--legal-comments=none --outfile=three.min.js
	cat idem_ros/viewer/three_licence.txt build/three/three.min.js > idem_ros/viewer/three.min.js

# a figure that is missed ends its command with 1, and the others go on
bench: $(READY)
	-$(BIN)/python -m benchmarks main --markdown docs/figures.md
	-$(BIN)/python -m benchmarks accuracy --markdown docs/bench_accuracy.md
	-$(BIN)/python -m benchmarks speed --markdown docs/bench_speed.md
	-$(BIN)/python -m benchmarks rings --markdown docs/bench_rings.md
	-$(BIN)/python -m benchmarks maps --markdown docs/bench_maps.md
	-$(BIN)/python -m benchmarks calibrate --markdown docs/bench_rigs.md
	-$(BIN)/python -m benchmarks real --markdown docs/bench_real.md
	-$(BIN)/python -m benchmarks ablate --markdown docs/bench_ablate.md
	-$(BIN)/python -m benchmarks trust --markdown docs/bench_trust.md
	-$(BIN)/python -m benchmarks sweeps --markdown docs/bench_sweeps.md
	-$(BIN)/python -m benchmarks tunnels --markdown docs/bench_tunnels.md
	-$(BIN)/python -m benchmarks several --markdown docs/bench_several.md
	-$(BIN)/python -m benchmarks smooth --markdown docs/bench_smooth.md
	-$(BIN)/python -m benchmarks evaluation --markdown docs/bench_evaluation.md
	-$(BIN)/python -m benchmarks viewer --markdown docs/bench_viewer.md

# build/lib is removed: setuptools would pack what is no longer in the checkout; the wheel is built from the sdist
build/dist/.ready: $(INSTALLED)/.ready FORCE
	rm -rf build/lib build/dist
	$(PINNED) $(INSTALLED_BIN)/python -m build --quiet --outdir build/dist .
	@touch $@

wheel: build/dist/.ready
	$(INSTALLED_BIN)/python -m pip install --quiet --force-reinstall --no-deps build/dist/*.whl
	IDEM_EXECUTABLES=$(INSTALLED_BIN) IDEM_SHARE=$(INSTALLED)/share/idem_ros $(CHECK)
	IDEM_DIST=build/dist $(INSTALLED_BIN)/python -m pytest -q test/check_distributions.py

# every pinned dependency has a wheel there: pip stops at the first that has not; nothing is run
aarch64: build/dist/.ready
	$(INSTALLED_BIN)/python -m pip download --quiet --dest build/aarch64 --constraint constraints.txt \
		--only-binary=:all: --python-version 3.12 --implementation cp \
		$(AARCH64:%=--platform %_aarch64) build/dist/*.whl
	@ls build/aarch64

# colcon writes the path of its own python into the nodes: it must be one that has rclpy
colcon: $(INSTALLED)/.ready
	rm -rf build/lib
	$(INSTALLED_BIN)/python -m colcon build --merge-install --paths .
	. ./install/setup.sh && \
		IDEM_EXECUTABLES=install/lib/idem_ros IDEM_SHARE=install/share/idem_ros $(CHECK)
	ROS_PYTHON_CHECK_FIELDS=1 $(INSTALLED_BIN)/python -m colcon test --merge-install --paths . \
		--event-handlers console_direct+ --return-code-on-test-failure --pytest-args $(ARGS)

soak: $(READY)
	$(BIN)/python -m benchmarks.soak $(ARGS)
	ROS_PYTHON_CHECK_FIELDS=1 IDEM_FUZZ=5000 $(BIN)/python -m pytest -q test/fuzz/test_fuzz.py test/fuzz/test_fuzz_live.py test/fuzz/test_fuzz_recordings.py

# an environment that sees the sourced ROS; where there is none, that of the other tests
ROS_VENV := $(if $(shell command -v ros2),.venv-ros,$(VENV))
ROS_TESTS := test/node/test_ros_packages.py test/node/test_launch.py test/node/test_node_inputs.py test/node/test_node_tf.py \
	test/node/test_node_outputs.py test/node/test_player.py

test-ros: $(ROS_VENV)/.ready
	ROS_PYTHON_CHECK_FIELDS=1 $(ROS_VENV)/bin/python -m pytest -rs $(ROS_TESTS) $(ARGS)

# no pins: messages of apt are compiled for the NumPy of apt
.venv-ros/.ready: setup.py setup.cfg pyproject.toml
	$(PYTHON) -m venv --system-site-packages .venv-ros
	.venv-ros/bin/python -m pip install --quiet --disable-pip-version-check \
		--editable '.[plot,bench,test]'
	@touch $@

fuzz: $(READY)
	$(BIN)/python fuzz $(ARGS)
	IDEM_FUZZ=10000 $(BIN)/python -m pytest -q test/fuzz/test_fuzz_files.py
	IDEM_INTERRUPTS=50 $(BIN)/python -m pytest -q test/terminal/test_interrupts.py

clean:
	rm -rf $(VENV) .venv-3.* .venv-ros $(SITE) $(INSTALLED) $(NEWEST) $(PINS) build install log *.egg-info

# kernels are compiled here: of the processes of the tests each that begins meanwhile would
$(READY): setup.py setup.cfg pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
		{ echo 'Python 3.10 or newer is needed; name one: make PYTHON=python3.12 ...'; exit 1; }
	@echo 'Setting up $(VENV) (once, about a minute) ...'
	$(PYTHON) -m venv $(VENV)
	$(PINNED) $(BIN)/python $(INSTALL) --editable '.[$(EXTRAS)]'
	$(BIN)/python -c "from idem_ros.core import warm_up; warm_up('solve')"
	@touch $@

# not the environment of the checkout: nothing of the source is found here, nor is colcon there
$(INSTALLED)/.ready: setup.py setup.cfg pyproject.toml constraints.txt
	@echo 'Setting up $(INSTALLED) (once, about two minutes) ...'
	$(PYTHON) -m venv $(INSTALLED)
	$(PINNED) $(INSTALLED_BIN)/python $(INSTALL) '.[$(EXTRAS)]' $(COLCON) build
	@touch $@
