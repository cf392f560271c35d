"""Shadow maps of one size, as the layers of a texture."""

import slangpy as spy

from pica.rhi.device import Device


class MapArray:
    """Square depth maps (size, size, layers, d32_float), reversed depth."""

    def __init__(self, device: Device, label: str, size: int, layers: int) -> None:
        self.size = size
        usage = spy.TextureUsage.depth_stencil | spy.TextureUsage.shader_resource
        # One layer more than none, so that it can be bound.
        self.texture = device.texture(label, spy.Format.d32_float, (size, size), usage, layers=max(layers, 1))
        self._views = [self.texture.create_view(layer=layer, layer_count=1) for layer in range(layers)]
        self.targets = [
            spy.RenderPassDesc(
                {
                    "depth_stencil_attachment": {
                        "view": view,
                        "depth_load_op": spy.LoadOp.clear,
                        "depth_clear_value": 0.0,
                    }
                }
            )
            for view in self._views
        ]
        """The render pass attachments of each layer."""
        self.state = spy.RenderState(
            {
                "viewports": [spy.Viewport.from_size(size, size)],
                "scissor_rects": [spy.ScissorRect.from_size(size, size)],
            }
        )
        self.state.index_format = spy.IndexFormat.uint32
