"""The public names of `echousd`, a line each: what docs/API.md is made of and what its first use imports."""

from echomodel.loading import load_model as load_model
from echomodel.vocabulary import vocabulary as vocabulary
from echousd.batches.batch import batch as batch
from echousd.batches.batch import generate_many as generate_many
from echousd.checks import check as check
from echousd.draw.from_files import render as render
from echousd.exporting.formats import export as export
from echousd.graph import GraphError as GraphError
from echousd.graph import Node as Node
from echousd.graph import Relation as Relation
from echousd.graph import RoomSpec as RoomSpec
from echousd.graph import SceneGraph as SceneGraph
from echousd.home.assemble import generate_home as generate_home
from echousd.home.graph import HomeGraph as HomeGraph
from echousd.home.importing.formats import import_plan as import_plan
from echousd.home.plan import plan_home as plan_home
from echousd.make.edit import edit as edit
from echousd.make.edit import redo as redo
from echousd.make.edit import undo as undo
from echousd.make.edit import update as update
from echousd.make.finished import Room as Room
from echousd.make.pipeline import generate as generate
from echousd.make.wishes import adopt as adopt
from echousd.options import RoomOptions as RoomOptions
from echousd.stage.boxes import read_dressing as read_dressing
from echousd.stage.boxes import relations_from_boxes as relations_from_boxes
from echousd.stage.graphs import update_graph as update_graph
from echousd.stage.graphs import write_graph as write_graph
from echousd.stage.read import read_graph as read_graph
from echousd.stage.read import read_rooms as read_rooms
from echousd.texturing import export_texture_job as export_texture_job
from echousd.texturing import import_texture_job as import_texture_job

__version__: str
