# The two commands of the README, and what they need. Everything Python lives in .venv; on Debian and Ubuntu
# missing system packages are installed with apt (through sudo where that is needed and possible).

VENV := .venv
PYTHON ?= python3
BIN := $(VENV)/bin
# Cyclone DDS with its security plugins, headers to build the Python binding, Fast DDS, and a PKCS#11 token.
APT_DEMO := python3-venv python3-dev gcc libc6-dev cyclonedds-dev cyclonedds-tools libddsc0debian openssl
APT_TEST := g++ libfastrtps-dev softhsm2 libxml2-utils
export CYCLONEDDS_HOME := $(CURDIR)/.dds-home
PYTEST_ARGS ?= -n 2

.PHONY: demo test lint bench clean
.DEFAULT_GOAL := test

demo: $(VENV)/.demo
	@PATH="$(CURDIR)/$(BIN):$$PATH" tools/demo

test: $(VENV)/.test
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python -m pytest $(PYTEST_ARGS)

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/mypy

bench: $(VENV)/.test
	for script in bench/*.py; do $(BIN)/python $$script; done

clean:
	rm -rf $(VENV) .dds-home build *.egg-info

$(VENV)/.demo: pyproject.toml tools/system-packages
	tools/system-packages $(APT_DEMO)
	tools/cyclonedds-home "$(CYCLONEDDS_HOME)"
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --editable '.[dds]'
	touch $@

$(VENV)/.test: $(VENV)/.demo
	tools/system-packages $(APT_TEST)
	$(BIN)/pip install --quiet --editable '.[dds,cpp,pkcs11,test,lint]'
	touch $@
