# The node on ROS 2 Jazzy: docker build -t idem_ros . && docker run --rm --net=host --ipc=host idem_ros idem_node --find
# Shared memory of the host (--ipc=host) is how clouds of megabytes come through; see docs/docker.md.
FROM ros:jazzy-ros-base
SHELL ["/bin/bash", "-o", "pipefail", "-c"]
RUN apt-get update && apt-get install -y --no-install-recommends \
        python3-colcon-common-extensions python3-jinja2 python3-lz4 python3-numpy python3-pandas \
        python3-pip python3-pydantic python3-scipy python3-tqdm python3-venv python3-yaml python3-zstandard \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /ws
COPY . src/idem_ros
# what Ubuntu lacks comes from PyPI, into an environment that sees the system's packages
RUN . /opt/ros/jazzy/setup.bash \
    && python3 -m venv --system-site-packages venv && touch venv/COLCON_IGNORE \
    && . venv/bin/activate && pip install --no-cache-dir ./src/idem_ros \
    && python -m colcon build --packages-select idem_ros
ENV HOME=/tmp
RUN . /opt/ros/jazzy/setup.bash && . venv/bin/activate && . install/setup.bash \
    && python -c 'from idem_ros.core import warm_up; warm_up()'
ENTRYPOINT ["/bin/bash", "-c", ". /opt/ros/jazzy/setup.bash && . /ws/venv/bin/activate && . /ws/install/setup.bash && exec \"$@\"", "--"]
CMD ["ros2", "launch", "idem_ros", "refine.launch.py", "target:=/map", "source:=/points", "initial_guess:=/guess"]
