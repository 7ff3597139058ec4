"""From photos to reference images: rectifying, measuring and judging them."""
