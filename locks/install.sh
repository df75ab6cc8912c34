#!/bin/sh
# What a lock holds, into /staged. What the environment has already is not installed again. Nobody in a container runs
# the packages' own tests, or compiles against them.
#
#   sh install.sh FILE.lock
set -e
python3 -m pip --python /opt/skillwing/bin/python install --no-warn-script-location --root /staged --require-hashes -r "$1"
find /staged -type d \( -name tests -o -name include \) -prune -exec rm -r {} +
