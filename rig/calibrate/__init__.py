"""A bench file and a plan of dead weights in; a recording, a calibration file, and a bench file that names it out."""
