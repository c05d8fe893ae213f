"""What a scene is made of: brake, duty, friction, loads, heat; and the statics of a band."""
