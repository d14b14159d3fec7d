"""Tests that are skipped on ANGLE over SwiftShader, with their reasons."""
from __future__ import annotations

from collections.abc import Iterable

import pytest

# SwiftShader moves a vertex by up to 1/32 pixel. The tests with this reason draw images that are
# 48 to 96 pixels wide, and allow smaller errors than such a shift causes.
COARSE_VERTICES = ("SwiftShader moves vertices to a grid of 1/16 pixel (GL_SUBPIXEL_BITS is 4; "
                   "Mesa has 8), so interpolated values are less exact and neighbouring patches "
                   "overlap")
# `test_infinity_in_a_half_float_target` in tests/gl/test_angle.py tests for SwiftShader's fault.
NO_HALVES = ("SwiftShader draws infinity into a half float target as NaN, so streams are in float "
             "textures")
TWO_PASSES = ("on ANGLE a pass has 7 render targets, but the hits of a packet of 4x2 need 8, so a "
              "second pass computes t, u and v; this test counts passes")
DESKTOP_TEXT = "this test needs the text for desktop OpenGL, which `gpgpu-rt program` prints"
DESKTOP_ERA = ("kernels in the era form use conversions from int to float that only desktop "
               "OpenGL has; test_angle.py tests the message")
# Words -> reason. A test is skipped if its name contains all these words.
EXCEPTIONS: dict[str, str] = {
    "test_refraction.py::test_a_slab_changes_no_direction": COARSE_VERTICES,
    "test_ray_bundles.py::test_a_furnace[0.8-6]": COARSE_VERTICES,
    "test_ray_bundles.py::test_form_factor_of_squares[0.5-0.41525]": COARSE_VERTICES,
    "test_ray_bundles.py::test_form_factor_of_squares[1.0-0.19982]": COARSE_VERTICES,
    "test_formats.py::test_half_textures_are_half": NO_HALVES,
    "test_packet_tiles.py::test_each_packet_is_drawn_once 4x2": TWO_PASSES,
    "test_packet_tiles.py::test_what_is_left_out_counts_nothing": TWO_PASSES,
    "test_program_text.py::test_each_text_compiles_by_itself": DESKTOP_TEXT,
    "test_program_text.py::test_conditions_are_decided_as_the_compiler_decides": DESKTOP_TEXT,
    "test_program_text.py::test_the_text_of_kd_restart_is_short_and_names_its_files": DESKTOP_TEXT,
    **dict.fromkeys((f"test_era.py::{name}" for name in (
        "test_finds_the_same_triangles", "test_shadow_rays_stop_at_a_hit",
        "test_rays_along_an_axis_end", "test_passes_can_be_watched",
        "test_a_short_stack_may_be_shorter", "test_a_search_that_does_not_end_is_an_error",
        "test_only_the_numbers_of_a_chip_may_be_given",
        "test_a_form_that_fp24_does_not_hold_is_refused")), DESKTOP_ERA),
    "test_pointers.py::test_walks_cross_the_rows_of_tables": DESKTOP_ERA,
    **dict.fromkeys((f"test_era_packets.py::{name}" for name in (
        "test_the_loop_finds_the_same_triangles", "test_the_loop_runs_the_kernels_of_the_trace",
        "test_images_of_odd_sizes", "test_rays_of_all_directions_take_turns",
        "test_moved_triangles_are_followed",
        "test_a_loop_that_the_renderer_ends_early_is_an_error")), DESKTOP_ERA),
    "test_adding_a_method.py::test_no_card_time_is_predicted": DESKTOP_ERA,
}


def skip_exceptions(items: Iterable[pytest.Item]) -> None:
    """Mark the tests in ``EXCEPTIONS`` as skipped."""
    for item in items:
        for name, reason in EXCEPTIONS.items():
            if all(word in item.nodeid for word in name.split()):
                item.add_marker(pytest.mark.skip(reason=reason))
