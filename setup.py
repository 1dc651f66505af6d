"""The one thing pyproject.toml cannot say: three source folders make up the two packages."""

from setuptools import find_packages, setup

setup(
    packages=[
        *find_packages(".", include=["echousd", "echousd.*"]),
        *find_packages("model", include=["echomodel", "echomodel.*"]),
        "echousd.schemas",
    ],
    package_dir={"echomodel": "model/echomodel", "echousd.schemas": "schemas"},
)
