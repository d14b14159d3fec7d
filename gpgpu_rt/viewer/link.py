"""The link between Dear ImGui and a moderngl window.

moderngl-window's own link creates all textures at the start, so it supports only ImGui before
1.92. Since 1.92, ImGui asks its renderer to create and to update textures at any time.
"""
from __future__ import annotations

import ctypes
from contextlib import suppress
from typing import Any

import glfw
import moderngl
import numpy as np
from imgui_bundle import imgui

from ..gl.context import Gpu
from ..gl.shader import compile_program

BUTTONS = {1: 0, 2: 1, 3: 2}    # moderngl-window's button -> ImGui's: left, right, middle
KEYS = ("TAB", "LEFT", "RIGHT", "UP", "DOWN", "PAGE_UP", "PAGE_DOWN", "HOME", "END", "DELETE",
        "BACKSPACE", "ENTER", "ESCAPE", "SPACE", *"ABCDEFGHIJKLMNOPQRSTUVWXYZ",
        "NUMBER_1", "NUMBER_2", "NUMBER_3")
NAMES = {"LEFT": "left_arrow", "RIGHT": "right_arrow", "UP": "up_arrow", "DOWN": "down_arrow",
         **{f"NUMBER_{k}": f"_{k}" for k in (1, 2, 3)}}
ANY_POPUP = imgui.PopupFlags_.any_popup.value


class Link:
    """Draws ImGui's draw lists in a window, and passes the window's events to ImGui.

    Parameters
    ----------
    gpu : the context to draw with
    window : a glfw window of moderngl_window; its context is the current context
    """

    def __init__(self, gpu: Gpu, window: Any) -> None:
        imgui.create_context()
        self.io = imgui.get_io()
        self.io.set_ini_filename("")     # store no window settings on disk
        self.io.backend_flags |= imgui.BackendFlags_.renderer_has_textures.value
        imgui.get_platform_io().renderer_texture_max_width = gpu.max_texture_size
        imgui.get_platform_io().renderer_texture_max_height = gpu.max_texture_size
        self.gpu, self.window, self.context = gpu, window, gpu.context
        imgui.get_platform_io().platform_set_clipboard_text_fn = (
            lambda _, text: glfw.set_clipboard_string(window._window, text))
        self._program = compile_program(gpu, "viewer/panel.frag", vertex="viewer/panel.vert")
        self._textures: dict[int, moderngl.Texture] = {}
        self._pictures: dict[str, moderngl.Texture] = {}
        self._room = (0, 0)
        self._keys = {getattr(window.keys, name): getattr(
            imgui.Key, NAMES.get(name, name.lower())) for name in KEYS}

    # Drawing --------------------------------------------------------------------------------

    def picture(self, name: str, pixels: np.ndarray, smooth: bool) -> imgui.ImTextureRef:
        """Upload (h, w, 3) uint8 pixels, row 0 at the top, as a named texture."""
        size = pixels.shape[1::-1]
        texture = self._pictures.get(name)
        if texture is None or texture.size != size:
            if texture is not None:
                del self._textures[texture.glo]
                texture.release()
            texture = self._pictures[name] = self.context.texture(size, 3, alignment=1)
            texture.repeat_x = texture.repeat_y = False
            self._textures[texture.glo] = texture
        texture.write(np.ascontiguousarray(pixels))
        mode = moderngl.LINEAR if smooth else moderngl.NEAREST
        texture.filter = mode, mode
        return imgui.ImTextureRef(texture.glo)

    def show(self, name: str, pixels: np.ndarray) -> None:
        imgui.image(self.picture(name, pixels, smooth=False), imgui.ImVec2(*pixels.shape[1::-1]))

    def begin(self, seconds: float) -> None:
        self.io.display_size = imgui.ImVec2(*self.window.size)
        ratio = self.window.pixel_ratio
        self.io.display_framebuffer_scale = imgui.ImVec2(ratio, ratio)
        self.io.delta_time = max(seconds, 1e-4)
        imgui.new_frame()

    def end(self) -> None:
        imgui.render()
        for texture in imgui.get_platform_io().textures:
            self._follow(texture)
        width, height = self.window.buffer_size
        if min(width, height) < 1:
            return
        context = self.context
        self.window.use()
        context.viewport = 0, 0, width, height
        context.enable_only(moderngl.BLEND)
        context.blend_equation = moderngl.FUNC_ADD
        context.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
        self._program["window"].value = tuple(self.window.size)
        self._program["picture"].value = 0
        self._program.extra = None
        ratio = self.window.pixel_ratio
        try:
            for commands in imgui.get_draw_data().cmd_lists:
                self._draw(commands, height, ratio)
        finally:
            context.scissor = None
            context.enable_only(moderngl.NOTHING)

    def abandon(self) -> None:
        """End an incomplete frame, if any, without drawing it."""
        with suppress(Exception):
            imgui.end_frame()

    def _draw(self, commands: Any, height: int, ratio: float) -> None:
        vertices = commands.vtx_buffer.size() * imgui.VERTEX_SIZE
        indices = commands.idx_buffer.size() * imgui.INDEX_SIZE
        if not vertices or not indices:
            return
        self._make_room(vertices, indices)
        for buffer, data, size in ((self._vertices, commands.vtx_buffer, vertices),
                                   (self._indices, commands.idx_buffer, indices)):
            buffer.write((ctypes.c_byte * size).from_address(data.data_address()))
        for command in commands.cmd_buffer:
            texture = self._textures.get(command.get_tex_id())
            x0, y0, x1, y1 = (round(ratio * edge) for edge in command.clip_rect)
            if texture is None or x1 <= x0 or y1 <= y0:
                continue
            texture.use(0)
            self.context.scissor = x0, height - y1, x1 - x0, y1 - y0
            self._geometry.render(moderngl.TRIANGLES, vertices=command.elem_count,
                                  first=command.idx_offset)
            self.gpu.fences.keep()

    def _make_room(self, vertices: int, indices: int) -> None:
        """Make the buffers at least this large, in bytes."""
        if vertices <= self._room[0] and indices <= self._room[1]:
            return
        if any(self._room):
            for part in (self._geometry, self._vertices, self._indices):
                part.release()
        self._room = max(2 * vertices, 1 << 18), max(2 * indices, 1 << 17)
        self._vertices, self._indices = (self.context.buffer(reserve=size, dynamic=True)
                                         for size in self._room)
        self._geometry = self.context.vertex_array(
            self._program, [(self._vertices, "2f 2f 4f1", "position", "place", "tint")],
            index_buffer=self._indices, index_element_size=imgui.INDEX_SIZE)

    def _follow(self, wanted: imgui.ImTextureData) -> None:
        """Create, update or destroy a texture of ImGui, as ImGui asks."""
        status = imgui.ImTextureStatus
        if wanted.status == status.want_destroy:
            texture = self._textures.pop(wanted.tex_id, None)
            if texture is not None:
                texture.release()
            wanted.set_tex_id(0)
            wanted.status = status.destroyed
            return
        if wanted.status not in (status.want_create, status.want_updates):
            return
        pixels = np.ascontiguousarray(wanted.get_pixels_array()).tobytes()
        if wanted.status == status.want_create:
            texture = self.context.texture((wanted.width, wanted.height), 4)
            self._textures[texture.glo] = texture
            wanted.set_tex_id(texture.glo)
        self._textures[wanted.tex_id].write(pixels)
        wanted.status = status.ok

    # Events ---------------------------------------------------------------------------------

    def mouse_at(self, x: float, y: float) -> None:
        self.io.add_mouse_pos_event(x, y)

    def button(self, button: int, down: bool) -> None:
        if button in BUTTONS:
            self.io.add_mouse_button_event(BUTTONS[button], down)

    def wheel(self, across: float, along: float) -> None:
        self.io.add_mouse_wheel_event(across, along)

    def key(self, key: int, down: bool, modifiers: Any) -> None:
        self.io.add_key_event(imgui.Key.mod_ctrl, bool(modifiers.ctrl))
        self.io.add_key_event(imgui.Key.mod_shift, bool(modifiers.shift))
        if key in self._keys:
            self.io.add_key_event(self._keys[key], down)

    def let_go(self) -> None:
        self.io.clear_input_keys()

    def text(self, character: str) -> None:
        if character.isprintable():
            self.io.add_input_character(ord(character))

    @property
    def has_mouse(self) -> bool:
        return bool(self.io.want_capture_mouse)

    # The following properties are valid only after `begin`. In `begin`, ImGui processes clicks and
    # keys in order, so a key goes to the panel that an earlier click has opened.

    @property
    def has_keys(self) -> bool:
        """Whether keys go to a panel: the user types text, or a list is open."""
        return bool(self.io.want_text_input) or self.has_popup

    @property
    def has_popup(self) -> bool:
        return imgui.is_popup_open("", ANY_POPUP)

    @staticmethod
    def close_popup() -> None:
        imgui.internal.close_popup_to_level(0, True)

    def pressed(self, key: int, repeat: bool = False) -> bool:
        """Return whether a key was pressed in this frame. With ``repeat``, a key that stays down
        counts again at intervals."""
        return imgui.is_key_pressed(self._keys[key], repeat)

    def held(self, key: int) -> bool:
        return imgui.is_key_down(self._keys[key])
