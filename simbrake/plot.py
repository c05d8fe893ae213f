"""Pictures. Each function draws into a given figure or makes one, and returns it; nothing is ever shown."""

from ._pictures._plot_animation import animate as animate
from ._pictures._plot_duty import duty as duty
from ._pictures._plot_layouts import angles as angles
from ._pictures._plot_layouts import chord_angles as chord_angles
from ._pictures._plot_layouts import layouts as layouts
from ._pictures._plot_maps import depth as depth
from ._pictures._plot_maps import lining_map as lining_map
from ._pictures._plot_materials import materials as materials
from ._pictures._plot_pressed import pressed as pressed
from ._pictures._plot_published import published as published
from ._pictures._plot_pulley import pulley as pulley
from ._pictures._plot_runs import contacts as contacts
from ._pictures._plot_runs import stages as stages
from ._pictures._plot_runs import stop as stop
from ._pictures._plot_runs import temperatures as temperatures
from ._pictures._plot_studies import calibration as calibration
from ._pictures._plot_studies import tornado as tornado
from ._pictures._plot_uncertainty import distribution as distribution
from ._pictures._plot_uncertainty import effects as effects
from ._pictures._plot_uncertainty import indices as indices
from ._pictures._plot_wear import wear as wear
from ._pictures._plot_work_precision import work_precision as work_precision
