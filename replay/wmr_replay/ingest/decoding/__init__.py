"""Message encodings (CDR, ROS 1, protobuf, JSON) to columns of numbers.

This room holds schema definitions, the layout of a message's fields, and the compiled passes that read many
messages of one layout. It knows neither topics nor roles: a binding says which fields are wanted.
"""
