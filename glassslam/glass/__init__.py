"""Glass: observations bound to nodes, walls fitted from them, cells locked in the map."""
