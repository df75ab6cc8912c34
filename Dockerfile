# One file, two images: `manager` holds what a skill manager needs (Zenoh, msgspec, the language), `full` adds
# physics, missions and the viewer. The wheel is built once; nothing but it and its locked dependencies is installed.
ARG BASE=python:3.11-slim

FROM ${BASE} AS wheel
WORKDIR /build
COPY locks/build.lock locks/
RUN python3 -m venv /venv && /venv/bin/pip install --no-cache-dir --require-hashes -r locks/build.lock
COPY pyproject.toml README.md LICENSE ./
COPY dsl dsl
COPY services services
COPY sim_mujoco sim_mujoco
COPY bt_missions bt_missions
COPY docs/errors docs/errors
RUN /venv/bin/pip wheel --no-cache-dir --no-deps --no-build-isolation --wheel-dir /wheel .

FROM ${BASE} AS manager-environment
COPY locks/manager.lock /tmp/
RUN python3 -m venv /opt/skillwing && /opt/skillwing/bin/pip install --no-cache-dir --require-hashes -r /tmp/manager.lock

FROM ${BASE} AS full-environment
COPY locks/full.lock /tmp/
RUN python3 -m venv /opt/skillwing && /opt/skillwing/bin/pip install --no-cache-dir --require-hashes -r /tmp/full.lock

FROM manager-environment AS manager
COPY --from=wheel /wheel /tmp/wheel
RUN /opt/skillwing/bin/pip install --no-cache-dir --no-deps /tmp/wheel/*.whl \
    && useradd --create-home --uid 1000 skillwing \
    && install -d -o skillwing -g skillwing /home/skillwing/runs
ENV PATH=/opt/skillwing/bin:$PATH PYTHONUNBUFFERED=1
USER skillwing
WORKDIR /home/skillwing
ENTRYPOINT ["python3", "-m", "skillwing.services.processes.node_host"]

FROM full-environment AS full
COPY --from=wheel /wheel /tmp/wheel
RUN /opt/skillwing/bin/pip install --no-cache-dir --no-deps /tmp/wheel/*.whl \
    && useradd --create-home --uid 1000 skillwing \
    && install -d -o skillwing -g skillwing /home/skillwing/runs
ENV PATH=/opt/skillwing/bin:$PATH PYTHONUNBUFFERED=1 MPLBACKEND=Agg
USER skillwing
# The viewer would send usage data from its second start on.
RUN rerun analytics disable
WORKDIR /home/skillwing
ENTRYPOINT ["python3", "-m", "skillwing.services.processes.node_host"]
