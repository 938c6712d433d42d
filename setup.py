"""Install idem_ros, with pip or as a ROS 2 ament_python package with colcon."""

from glob import glob

from setuptools import find_packages, setup

PACKAGE = 'idem_ros'
ROS = ['ros-jazzy-rclpy[fastrtps]', 'ros-jazzy-common-interfaces']
PLOT = ['matplotlib']
EXPERIMENTS = ['matplotlib', 'pymeshlab']
TEST = [
    'pytest',
    'pytest-xdist',
    'hypothesis',
    'pypcd4',
    'ruff==0.17.6',
    'basedpyright==1.40.2',
    'evo',
    'import-linter',
    'mcap-ros2-support',
]
SURVEY = ['laspy[lazrs]>=2.5', 'pye57']
CLUSTER = ['distributed']
VIEW = ['rerun-sdk']
SITE = ['mkdocs-material', 'mkdocstrings[python]']
BENCH = ['small_gicp', 'kiss-icp', 'psutil', 'pillow']

setup(
    name=PACKAGE,
    version='0.2.0',
    description='Online fine registration of point clouds by entropy minimisation (IDEM)',
    license='Apache-2.0',
    maintainer='idem_ros maintainers',
    maintainer_email='maintainers@idem-ros.invalid',
    python_requires='>=3.10',
    packages=find_packages(include=[PACKAGE, f'{PACKAGE}.*']),
    package_data={
        PACKAGE: ['py.typed'],
        f'{PACKAGE}.report': ['report.css', 'report.html.jinja', 'report.js'],
        f'{PACKAGE}.viewer': ['*.css', '*.jinja', '*.js', '*.txt'],
    },
    install_requires=[
        'setuptools',
        'numpy',
        'scipy',
        'numba',
        'rosbags>=0.11',
        'jinja2>=3',
        'mcap>=1.2',
        'lz4',
        'zstandard',
        'plyfile',
        'python-neo-lzf',
        'pandas',
        'pydantic>=2',
        'pyyaml',
        'tqdm',
    ],
    extras_require={
        'ros': ROS,
        'plot': PLOT,
        'experiments': EXPERIMENTS,
        'survey': SURVEY,
        'bench': BENCH,
        'site': SITE,
        'cluster': CLUSTER,
        'view': VIEW,
        'test': TEST,
    },
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
        (f'share/{PACKAGE}/launch', glob('launch/*.launch.py')),
        (f'share/{PACKAGE}/config', glob('config/*')),
    ],
    zip_safe=False,
    entry_points={
        'console_scripts': [
            'idem = idem_ros.commands.entry:main',
            'idem_node = idem_ros.node.entry:main',
            'idem_lifecycle_node = idem_ros.node.entry:main_managed',
            'idem_rig_node = idem_ros.node.entry:main_rig',
        ]
    },
)
