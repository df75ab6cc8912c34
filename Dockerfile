# One file, an image for each role, in stages that share their layers:
#
#   manager    the router, the bridge, every manager and mock, and the command line: Zenoh, msgspec, the language
#   onboard    manager + what a vehicle's computer runs below the skills: numpy, scipy, video
#   sim        onboard + physics and ray casting: the simulated vehicle and its radio link
#   mission    manager + behaviour trees, and numpy for what is known of a site
#   recorder   manager + Rerun's logging
#   viewer     manager + Rerun's viewer, one program
#
# Packages are those of locks/, hashes checked. pip takes its settings from build arguments, such as
# `--build-arg PIP_INDEX_URL=...`. They stay in the stages that build: no image has them in its history. Each stage
# declares them, because the classic builder does not inherit them from the stage before.
ARG BASE=python:3.11-slim

# --- what is installed, each set in a folder /staged of its own ----------------------------------------------------

FROM ${BASE} AS packages
ARG PIP_INDEX_URL
ARG PIP_EXTRA_INDEX_URL
ARG PIP_TRUSTED_HOST
ARG PIP_CERT
# pip installs into the environment from outside, so that it need not be there.
ENV PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_ROOT_USER_ACTION=ignore
RUN python3 -m venv /build && python3 -m venv --without-pip /opt/skillwing
COPY locks/manager.lock locks/
RUN python3 -m pip --python /opt/skillwing/bin/python install --require-hashes -r locks/manager.lock

FROM packages AS code
ARG PIP_INDEX_URL
ARG PIP_EXTRA_INDEX_URL
ARG PIP_TRUSTED_HOST
ARG PIP_CERT
COPY locks/build.lock locks/
RUN /build/bin/pip install --require-hashes -r locks/build.lock
WORKDIR /source
COPY pyproject.toml README.md LICENSE ./
COPY dsl dsl
COPY services services
COPY sim_mujoco sim_mujoco
COPY bt_missions bt_missions
COPY docs/errors docs/errors
RUN /build/bin/pip wheel --no-deps --no-build-isolation --wheel-dir /wheel . \
    && python3 -m pip --python /opt/skillwing/bin/python install --no-warn-script-location --no-deps --root /staged /wheel/*.whl

# --- what every container has ----------------------------------------------------------------------------------------

FROM ${BASE} AS runtime
RUN useradd --create-home --uid 1000 skillwing \
    && install -d -o skillwing -g skillwing /home/skillwing/runs
# Where volumes are mounted: each new one takes its owner from the folder of the image.
RUN cd /home/skillwing && install -d -m 700 -o skillwing -g skillwing keys keys/authority keys/people keys/people/cli \
    keys/robots keys/robots/m600 keys/robots/m600-mocks
COPY --from=packages /opt/skillwing /opt/skillwing
# One container is one process of the system, and takes one core for its matrices (processes/child.py).
ENV PATH=/opt/skillwing/bin:$PATH PYTHONUNBUFFERED=1 OMP_NUM_THREADS=1
WORKDIR /home/skillwing
ENTRYPOINT ["python3", "-m", "skillwing.services.processes.node_host"]

FROM runtime AS manager
COPY --from=code /staged /
USER skillwing

# --- the other roles -------------------------------------------------------------------------------------------------

FROM packages AS onboard-packages
ARG PIP_INDEX_URL
ARG PIP_EXTRA_INDEX_URL
ARG PIP_TRUSTED_HOST
ARG PIP_CERT
COPY locks/install.sh locks/onboard.lock locks/
RUN sh locks/install.sh locks/onboard.lock

FROM runtime AS onboard
COPY --from=onboard-packages /staged /
COPY --from=code /staged /
USER skillwing

FROM packages AS sim-packages
ARG PIP_INDEX_URL
ARG PIP_EXTRA_INDEX_URL
ARG PIP_TRUSTED_HOST
ARG PIP_CERT
COPY locks/install.sh locks/sim.lock locks/
RUN sh locks/install.sh locks/sim.lock

FROM runtime AS sim
COPY --from=sim-packages /staged /
COPY --from=code /staged /
USER skillwing

FROM packages AS mission-packages
ARG PIP_INDEX_URL
ARG PIP_EXTRA_INDEX_URL
ARG PIP_TRUSTED_HOST
ARG PIP_CERT
COPY locks/install.sh locks/mission.lock locks/
RUN sh locks/install.sh locks/mission.lock

FROM runtime AS mission
COPY --from=mission-packages /staged /
COPY --from=code /staged /
USER skillwing
ENTRYPOINT ["skillwing", "mission", "run"]

# Rerun comes as a library and a program, of which one image needs the first and one the second. Both would send usage
# data from their second start on.
FROM packages AS rerun-packages
ARG PIP_INDEX_URL
ARG PIP_EXTRA_INDEX_URL
ARG PIP_TRUSTED_HOST
ARG PIP_CERT
COPY locks/install.sh locks/recorder.lock locks/
RUN sh locks/install.sh locks/recorder.lock \
    && cd /staged && site=$(echo opt/skillwing/lib/python3*/site-packages) \
    && mkdir -p /program/$site && mv $site/rerun_cli /program/$site/ \
    && HOME=/home/skillwing /program/$site/rerun_cli/rerun analytics disable

FROM runtime AS recorder
COPY --from=rerun-packages /staged /
COPY --from=rerun-packages --chown=skillwing:skillwing /home/skillwing/.config /home/skillwing/.config
COPY --from=code /staged /
USER skillwing

FROM runtime AS viewer
COPY --from=rerun-packages /program /
COPY --from=rerun-packages --chown=skillwing:skillwing /home/skillwing/.config /home/skillwing/.config
COPY --from=code /staged /
USER skillwing
