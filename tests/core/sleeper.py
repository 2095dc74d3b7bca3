"""A program that says its number and sleeps."""

import os
import time

if __name__ == "__main__":
    print(os.getpid(), flush=True)
    time.sleep(600)
