"""Running scenes: once, by load steps, on finer and finer meshes, from several starts.

The folder is not called `run`, because `bemkit.run` is the function.
"""
