"""What is drawn in three dimensions: mechanism, person, forces, closed chains."""
