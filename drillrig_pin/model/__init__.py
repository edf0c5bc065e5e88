"""From a file people edit to a URDF text and a list of extension elements. Knows no element class and no physics."""
