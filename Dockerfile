# nscan-cli with its compiled code, so that a container starts warm:
#   docker build -t nscan-cli .
#   docker run --rm -u $(id -u) -v "$PWD:/data" nscan-cli slam my_bag/ -o my_bag.json --map my_bag.png
FROM python:3.12-slim

# The code that warm-up compiles lies where every user can read it and add to it.
ENV NUMBA_CACHE_DIR=/var/cache/numba
COPY . /src
RUN pip install --no-cache-dir /src && rm -rf /src \
 && nscan-cli warm-up \
 && chmod -R a+rwX /var/cache/numba

WORKDIR /data
ENTRYPOINT ["nscan-cli"]
CMD ["--help"]
