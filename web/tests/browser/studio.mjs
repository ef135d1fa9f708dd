// A stand-in for sysid_studio: the API of web/src/page_data.ts, without fits.
import {createServer} from 'node:http';

export async function startStudio(html, pageNow) {
  const streams = new Set(), posts = [], requests = [], waiting = [];
  let now = {type: 'idle'}, refusal = null;
  const json = (response, status, body) => {
    response.writeHead(status, {'Content-Type': 'application/json'});
    response.end(JSON.stringify(body));
  };
  const server = createServer((request, response) => {
    requests.push(`${request.method} ${request.url}`);
    if (request.url === '/') {
      response.writeHead(200, {'Content-Type': 'text/html'});
      response.end(html);
    } else if (request.url === '/api/page') {
      json(response, 200, pageNow());
    } else if (request.url === '/api/events') {
      response.writeHead(200, {'Content-Type': 'text/event-stream'});
      response.write(`data: ${JSON.stringify(now)}\n\n`);
      streams.add(response);
      for (const tell of waiting.splice(0)) tell();
      request.on('close', () => streams.delete(response));
    } else if (request.method === 'POST') {
      let body = '';
      request.on('data', part => { body += part; });
      request.on('end', () => {
        posts.push({url: request.url, body: JSON.parse(body), type: request.headers['content-type']});
        if (refusal) json(response, 409, refusal);
        else json(response, 202, {});
      });
    } else if (request.url.startsWith('/api/models/')) {
      response.writeHead(200, {'Content-Type': 'application/xml'});
      response.end('<robot/>');
    } else {
      json(response, 404, {error: 'nothing here', hint: ''});
    }
  });
  let port = 0;
  const listen = () => new Promise(resolve => server.listen(port, '127.0.0.1', resolve));
  await listen();
  port = server.address().port;
  return {
    url: `http://127.0.0.1:${port}/`, posts, requests,
    // Once a page listens to the events.
    followed: () => streams.size ? Promise.resolve() : new Promise(resolve => waiting.push(resolve)),
    refuse(answer) { refusal = answer; },
    say(event) {
      now = ['done', 'cancelled', 'failed'].includes(event.type) ? {type: 'idle'} : event;
      for (const s of streams) s.write(`data: ${JSON.stringify(event)}\n\n`);
    },
    async goAway() {
      for (const s of streams) s.destroy();
      server.closeAllConnections();
      await new Promise(resolve => server.close(resolve));
    },
    comeBack: listen,
  };
}
