"""Drawing of images: the empty scene, people, shadows, light, blur and noise, and the exact truth of pixels."""
