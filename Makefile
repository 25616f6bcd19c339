# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

# Two commands suffice: `make demo` runs the main job, `make test` every test. Each first sets up
# and builds what is missing. The work is done in scripts/; a particular Python is chosen by
# `make PYTHON=python3.12 ...`.

SHELL := /bin/bash
export PYTHON

in_env = source ./env.bash &&

.PHONY: help demo test lint format bench figures docs setup build lock clean distclean

help: ## list the targets
	@grep -E '^[a-z]+:.*##' Makefile | sed -E 's/^([a-z]+):.*## /\1\t/' | expand -t 12

demo: build ## set up, build, then simulate a walk and entrain it: entrain run
	@$(in_env) entrain run

test: build ## set up, build, then run every test (PYTEST_ARGS="-k name" selects some)
	@$(in_env) scripts/test.sh $(PYTEST_ARGS)

lint: build ## ruff, mypy, import-linter, licence headers, ament linters
	@$(in_env) scripts/lint.sh

format: setup ## let ruff rewrite the sources
	@.venv/bin/ruff check --fix . ; .venv/bin/ruff format .

bench: build ## measure the speeds in the README, each next to its baseline
	@$(in_env) pytest -s -m benchmark tests/benchmarks

figures: build ## redraw the pictures in docs
	@$(in_env) python scripts/make_figures.py

docs: build ## HTML of the public names: docs/api/index.html
	@$(in_env) python scripts/make_api_pages.py

setup: ## ROS 2 Jazzy and pinned Python packages in .venv
	@scripts/setup.sh

build: setup ## build the workspace with colcon
	@scripts/build.sh

lock: ## resolve requirements/*.in again
	@scripts/lock.sh

clean: ## remove what was built
	rm -rf ros2_ws/build ros2_ws/install ros2_ws/log docs/api
	find . -path ./.venv -prune -o -name __pycache__ -type d -exec rm -rf {} +

distclean: clean ## remove the environment too
	rm -rf .venv
