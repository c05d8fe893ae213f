"""Parts of a scene: brake, duty, friction, loads, heat; and the statics of a band."""
