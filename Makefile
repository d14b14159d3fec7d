# These targets are for users. `make` alone prints their list.
VENV   ?= .venv
PYTHON ?= python3
BIN    := $(VENV)/bin
STAMP  := $(VENV)/.installed

.DEFAULT_GOAL := help
.PHONY: help setup scenes test test-all figures report web pictures view docs bench lint format clean

help:  ## print this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 12

setup: $(STAMP)  ## make the virtual environment, and install Mesa where it is missing

$(STAMP): setup.cfg pyproject.toml tools/setup.sh
	@PYTHON="$(PYTHON)" sh tools/setup.sh "$(VENV)"
	@touch $(STAMP)

scenes: $(STAMP)  ## show the terms of the papers' scenes, ask, and download the scenes
	@$(BIN)/gpgpu-rt scenes --fetch

test: $(STAMP)  ## the quick suite, headless
	@$(BIN)/python tools/run_tests.py

test-all: $(STAMP)  ## all tests at full size on every backend; parts of them on softpipe, zink, ANGLE, fresh machines
	@$(BIN)/python tools/run_tests.py --all

figures: $(STAMP)  ## measure the survey's figures (FULL=1: the papers' sizes; SCHEDULER=local: a process per core)
	@$(BIN)/python -m gpgpu_rt.figures $(if $(FULL),--full) $(if $(SCHEDULER),--scheduler $(SCHEDULER))

report: $(STAMP)  ## write the page report.html, with all measured figures, films of passes and heat maps
	@$(BIN)/gpgpu-rt report -o report.html

web: $(STAMP)  ## write pages that trace in a browser, with an index, to the folder web (SCENE=name or file)
	@$(BIN)/gpgpu-rt web $(or $(SCENE),teapot) -m all -o web

docs: $(STAMP)  ## write the documentation as a site with a search to the folder site; needs no network
	@$(BIN)/python tools/make_site.py

pictures: $(STAMP)  ## make the pictures of the README again, in docs/readme
	@$(BIN)/python tools/make_pictures.py

view: $(STAMP)  ## open a window that shows the bunny by any method (SCENE=name or file)
	@$(BIN)/python -c "import moderngl_window, imgui_bundle, glfw" 2>/dev/null || \
		$(BIN)/python -m pip install --quiet --editable '.[view]'
	@$(BIN)/gpgpu-rt view $(SCENE)

bench: $(STAMP)  ## time the methods and today's ray tracing engines on the bunny
	@$(BIN)/gpgpu-rt bench bunny

lint: $(STAMP)  ## flake8, isort and autopep8, all with the settings in setup.cfg
	@$(BIN)/flake8 gpgpu_rt figures tests tools examples
	@$(BIN)/isort --check-only --diff gpgpu_rt figures tests tools examples
	@$(BIN)/autopep8 --diff --exit-code --recursive gpgpu_rt figures tests tools examples

format: $(STAMP)  ## apply isort and autopep8
	@$(BIN)/isort gpgpu_rt figures tests tools examples
	@$(BIN)/autopep8 --in-place --recursive gpgpu_rt figures tests tools examples

clean:  ## remove what was built and measured, but keep the virtual environment
	rm -rf build dist *.egg-info site report.html web figures/data figures/out .pytest_cache
	find . -name __pycache__ -not -path './$(VENV)/*' -prune -exec rm -rf {} +
