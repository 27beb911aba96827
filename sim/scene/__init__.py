"""What stands in the world and how a camera sees it: camera, bodies, terrain, rays, visibility."""
