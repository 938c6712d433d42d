# make demo: the node refines a recorded drive, live. make test: every test. Each sets itself up.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: demo test lint docs bench clean help

help:
	@echo 'make demo    start the node, play bags/demo.mcap to it and show each refined transform'
	@echo 'make test    run the tests'
	@echo 'make lint    check style'
	@echo 'make docs    write the tables and the picture of the README again'
	@echo 'make bench   measure accuracy and time'
	@echo 'make clean   remove the virtual environment and what was built'

demo: $(READY)
	$(BIN)/idem demo

test: $(READY)
	ROS_PYTHON_CHECK_FIELDS=1 $(BIN)/python -m pytest $(ARGS)

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

docs: $(READY)
	$(BIN)/idem docs

bench: $(READY)
	$(BIN)/idem bench main --markdown docs/figures.md
	$(BIN)/idem bench accuracy --markdown docs/bench_accuracy.md
	$(BIN)/idem bench speed --markdown docs/bench_speed.md

clean:
	rm -rf $(VENV) build install log *.egg-info

$(READY): setup.py setup.cfg pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
		{ echo 'Python 3.10 or newer is needed; name one: make PYTHON=python3.12 ...'; exit 1; }
	@echo 'Setting up $(VENV) (once, about a minute) ...'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check \
		--editable '.[ros,plot,bench,cluster,test]' --constraint constraints.txt
	@touch $@
