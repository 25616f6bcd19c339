#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

# Install Chromium and its driver, which the tests use, if they are missing and can be installed.
set -euo pipefail

command -v chromium > /dev/null && command -v chromedriver > /dev/null && exit 0
if [ "$(id -u)" != 0 ] || ! command -v apt-get > /dev/null; then
    echo "install_browser: tests of pages need Chromium: apt install chromium chromium-driver" >&2
    exit 1
fi
echo "install_browser: installing Chromium ..."
apt-get update -qq
DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
    chromium chromium-driver > /dev/null
